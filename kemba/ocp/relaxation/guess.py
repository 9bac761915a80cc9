"""Automatic start guess.

The body and the feet follow a course in outline; legs follow by inverse kinematics, forces and
valves by virtual work. Without `contacts` in the task the course is a jump: the body rests, is
pushed, flies and lands, its feet under its hips. With `contacts`, each foot stands where its hip
passes in the middle of its stance, and swings from there to its next place; the body flies on
parabolas between the stances.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from kemba.mechanism import Robot
from kemba.mechanism.knee import extension, flexion
from kemba.model import Model
from kemba.ocp.task.moments import spans
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import Task
from kemba.ocp.task.terrain import ground_at
from kemba.ocp.transcription.layout import Layout

Array = np.ndarray
WITHIN = np.linspace(0.05, 0.95, 19)  # shares of a swing at which it is looked what stands below
LIFT = 0.05  # m; how high a foot swings over the line between its places
FOLDED = 0.4  # leg length in flight, between retracted (0) and stretched (1)
STANDS = 0.7  # the same where a flight begins or ends

# leg length at take-off: short of the stretched knee, where virtual work is singular
STRETCH = 0.92
RISE = 0.7  # longest flight up to the apex, of the time before it: the push needs the rest
LANDING = 0.3  # leg length after a landing, between retracted (0) and stretched (1)
LEAST_FLIGHT = 0.05  # s; keeps the speed forward finite without a flight


@dataclass(frozen=True)
class Course:
    """Along times (n,): x, z [m] and pitch [rad] of the body; by leg the foot from its hip [m],
    ahead and below (n, 2), and its share of the weight (n,) [N]."""

    x: Array
    z: Array
    pitch: Array
    feet: dict[str, Array]
    load: dict[str, Array]


@dataclass(frozen=True)
class HeightCourse:
    """Knots of the body's height: times [s], heights [m], rates [m.s-1], and the flight's span."""

    t: list[float]
    z: list[float]
    vz: list[float]
    flight: tuple[float, float]

    def __call__(self, t: Array, order: int = 0) -> Array:
        """Cubic between the knots, held beyond them; `order` of the time derivative.

        By hand: scipy.interpolate takes longer to import than a program to build.
        """
        knots, z, v = (np.asarray(a, float) for a in (self.t, self.z, self.vz))
        t = np.clip(t, knots[0], knots[-1])
        i = np.clip(np.searchsorted(knots, t, side="right") - 1, 0, len(knots) - 2)
        h = knots[i + 1] - knots[i]
        rise = (z[i + 1] - z[i]) / h
        bend = [(3 * rise - 2 * v[i] - v[i + 1]) / h, (v[i] + v[i + 1] - 2 * rise) / h**2]
        cubic = np.array([z[i], v[i], *bend])
        return np.asarray(polyval(t - knots[i], polyder(cubic, order), tensor=False))


def asked(requirements: Sequence[Requirement], name: str, at: float) -> float | None:
    """The value required of a quantity at a moment, or None where it has no limits."""
    there = (
        _limit(r) for r in requirements if (r.quantity.name, r.at, r.minus) == (name, at, None)
    )
    return next((limit for limit in there if limit is not None), None)


def _limit(r: Requirement) -> float | None:
    """The lower limit of a requirement, else the upper one; None of what is only to be large."""
    return next(filter(np.isfinite, (r.lower, r.upper)), None)


def jump(
    model: Model,
    task: Task,
    requirements: Sequence[Requirement],
    t: Array,
    reach: tuple[float, float],
) -> Course:
    """The course of a jump along t (n,) [s]; `reach` = leg length retracted and stretched [m]."""
    robot, scene = model.mechanism.need_robot(), model.mechanism.scene
    ground = ground_at(model, requirements, 0.0), ground_at(model, requirements, 1.0)
    if task.guess == "standing":
        still = task.duration
        course = HeightCourse([0.0, still], [reach[0] + ground[0]] * 2, [0.0] * 2, (still, still))
    else:
        course = body_course(requirements, task.duration, reach, model.mechanism.gravity, ground)
    z, az = course(t), course(t, 2)
    airborne = (t > course.flight[0]) & (t < course.flight[1])
    x0, way = _from_to(requirements, "body/x")
    span = max(course.flight[1] - course.flight[0], LEAST_FLIGHT)
    x = x0 + way * np.clip((t - course.flight[0]) / span, 0.0, 1.0)
    stretched = reach[0] + STRETCH * (reach[1] - reach[0])
    feet = {}
    for leg, place in robot.legs.items():
        hips = np.column_stack([x + place.hip, z])
        if scene.cornered and airborne.any():  # up before a wall, then over it
            begin, end = course.flight
            parts = [(0.0, begin), (begin, end), (end, task.duration)]
            places = [r for r in requirements if r.quantity.name == f"{leg}/foot/x"]
            stands = np.array([True, False, end < task.duration])
            feet[leg] = _foot(task, parts, stands, t, hips, reach, places) - hips
        else:
            length = np.minimum(z - scene.ground.height(hips[:, 0]), stretched)
            feet[leg] = np.column_stack([np.zeros_like(length), -length])
    bears = model.mechanism.mass * np.maximum(az + model.mechanism.gravity, 0.0)
    load = np.where(airborne, 0.0, bears) / len(robot.legs)
    return Course(x, z, np.zeros_like(z), feet, dict.fromkeys(robot.legs, load))


def body_course(
    requirements: Sequence[Requirement],
    duration: float,
    reach: tuple[float, float],
    g: float,
    ground: tuple[float, float] = (0.0, 0.0),
) -> HeightCourse:
    """Height of the body over the motion; `reach` = leg length retracted and stretched [m],
    `ground` = height [m] where it starts and where it ends."""
    first, last = ground
    low, high = reach[0] + first, reach[1] + first
    top = low + STRETCH * (high - low)
    lands_at, bent = top + last - first, low + LANDING * (top - low) + last - first
    z0 = asked(requirements, "body/z", 0.0) or low
    z1 = asked(requirements, "body/z", 1.0)
    heights = (w for w in requirements if w.quantity.name == "body/z" and w.at)
    peak = max((w for w in heights if np.isfinite(w.lower)), key=lambda w: w.lower, default=None)
    feet = [w for w in requirements if w.quantity.name.endswith(("foot/z", "foot/gap"))]
    lands = any(w.at == 1.0 for w in feet)
    if z0 > top:
        fall = float(np.sqrt(2 * (z0 - lands_at) / g))
        course = HeightCourse([0.0, fall], [z0, lands_at], [0.0, -g * fall], (0.0, fall))
        return _landed(course, duration, z1 or bent)
    if peak is None or peak.at is None:
        return HeightCourse([0.0, duration], [z0, z1 or z0], [0.0, 0.0], (duration, duration))
    apex, t_apex = peak.lower, peak.at * duration
    lifted = (w for w in feet if w.holds(peak.at))
    lift = max((w.lower - first * (w.quantity.name[-1] == "z") for w in lifted), default=0.0)
    if lift > 0.0 and z0 < apex <= top:  # standing reaches it, but is not what is asked
        top = max(apex - lift, (z0 + apex) / 2)
        lands_at = top + last - first
    if apex <= top:
        course = HeightCourse([0.0, t_apex], [z0, apex], [0.0, 0.0], (t_apex, t_apex))
    else:
        longest = RISE * t_apex
        rise = min(float(np.sqrt(2 * (apex - top) / g)), longest)
        fall = min(float(np.sqrt(2 * max(apex - lands_at, 0.0) / g)), longest)
        speed = g * rise
        push = min(2 * (top - z0) / speed, t_apex - rise)
        start = t_apex - rise - push
        wait = [0.0] if start > 1e-6 else []
        knots = [*wait, start, t_apex - rise, t_apex]
        z = [*(z0 for _ in wait), z0, top, apex]
        vz = [*(0.0 for _ in wait), 0.0, speed, 0.0]
        end = t_apex + fall if lands and t_apex < duration else t_apex
        course = HeightCourse(knots, z, vz, (t_apex - rise, max(end, t_apex)))
        if lands and end < duration:
            course = HeightCourse([*knots, end], [*z, lands_at], [*vz, -g * fall], course.flight)
    if t_apex < duration and (lands or z1 is not None):
        return _landed(course, duration, z1 or bent)
    return course


def _landed(course: HeightCourse, duration: float, z: float) -> HeightCourse:
    if course.t[-1] >= duration:
        return course
    return HeightCourse([*course.t, duration], [*course.z, z], [*course.vz, 0.0], course.flight)


def in_order(
    model: Model,
    task: Task,
    requirements: Sequence[Requirement],
    t: Array,
    reach: tuple[float, float],
) -> Course:
    """The course of a motion with given contacts along t (n,) [s]; `reach` as for a jump."""
    robot, gravity = model.mechanism.need_robot(), model.mechanism.gravity
    parts = [(task.duration * a, task.duration * b) for a, b in spans(task.contacts)]
    rests = {w.at for w in requirements if w.location[-1] == "rest"}
    moving = [True] * len(parts)
    moving[0], moving[-1] = 0.0 not in rests, 1.0 not in rests
    turning = [not part.on for part in task.contacts] if rests else moving
    x, ground = _ahead(requirements, parts, moving, t), model.mechanism.scene.ground
    under = np.asarray(np.broadcast_to(ground.height(x), x.shape))
    stood = np.interp([0.0, *(b for _, b in parts)], t, under)
    z = _height(task, requirements, parts, reach, gravity, rests, stood)(t)
    first, turn = _from_to(requirements, "body/pitch")
    pitch = first + turn * _shared(parts, turning if any(turning) else moving, t)
    feet, load = {}, {}
    standing = np.array([[leg in part.on for leg in robot.legs] for part in task.contacts])
    bears = _load(parts, standing, model.mechanism.weight)
    here = np.clip(np.searchsorted([b for _, b in parts], t), 0, len(parts) - 1)
    for i, (leg, place) in enumerate(robot.legs.items()):
        hips = np.column_stack([x + place.hip * np.cos(pitch), z + place.hip * np.sin(pitch)])
        places = [r for r in requirements if r.quantity.name == f"{leg}/foot/x" and not r.minus]
        foot = _foot(task, parts, standing[:, i], t, hips, reach, places)
        feet[leg] = foot - hips
        load[leg] = np.where(standing[here, i], bears[here], 0.0)
    return Course(x, z, pitch, feet, load)


def _from_to(requirements: Sequence[Requirement], name: str) -> tuple[float, float]:
    """What is asked of a coordinate at the start, and how far it goes from there to the end."""
    first, last = (asked(requirements, name, at) for at in (0.0, 1.0))
    first = first if first is not None else 0.0
    return first, (last if last is not None else first) - first


def _ahead(
    requirements: Sequence[Requirement],
    parts: Sequence[tuple[float, float]],
    moving: Sequence[bool],
    t: Array,
) -> Array:
    """Where the body is ahead (n,) [m]: by the speeds that are asked for, or that ways need, then
    stretched to the way that is asked of the whole."""
    first, way = _from_to(requirements, "body/x")
    lasts = parts[-1][1]
    knots = {w.at: 0.0 for w in requirements if w.location[-1] == "rest" and w.at is not None}
    for w in requirements:
        value = _limit(w)
        if w.at is None or value is None or w.location[-1] == "rest":
            continue
        if w.quantity.name == "body/vx":
            knots[w.at] = value
        elif w.quantity.name == "body/x" and w.minus is not None and w.minus.name == "body/x":
            share = w.at - w.minus.at
            knots[w.minus.at + share / 2] = value / max(share * lasts, 1e-9)
    if not any(knots.values()):
        return first + way * _shared(parts, moving, t)
    still = [b for (a, b), on in zip(parts, moving, strict=True) if not on]
    knots |= {b / lasts: 0.0 for b in still if b < lasts}  # rests to the end of the first stance
    when = sorted(knots)
    speed = np.interp(t / lasts, when, [knots[k] for k in when])
    x = np.concatenate([[0.0], np.cumsum(np.diff(t) * 0.5 * (speed[1:] + speed[:-1]))])
    return first + x * (way / x[-1] if way and x[-1] else 1.0)


def _shared(parts: Sequence[tuple[float, float]], counts: Sequence[bool], t: Array) -> Array:
    """How much of the parts that count has passed (n,), from 0 to 1."""
    total = sum(b - a for (a, b), on in zip(parts, counts, strict=True) if on)
    passed = (np.clip(t, a, b) - a for (a, b), on in zip(parts, counts, strict=True) if on)
    return np.asarray(sum(passed, np.zeros_like(t)) / max(total, 1e-9))


def _height(
    task: Task,
    requirements: Sequence[Requirement],
    parts: Sequence[tuple[float, float]],
    reach: tuple[float, float],
    g: float,
    rests: set[float | None],
    ground: Array,
) -> HeightCourse:
    """The body's height: parabolas in flights, from legs that are stretched well. `ground`: its
    height (parts + 1,) [m] under the body where the parts begin and end."""
    top = reach[0] + STANDS * (reach[1] - reach[0])
    low = reach[0] + FOLDED * (reach[1] - reach[0])
    flies = [not part.on for part in task.contacts]
    wrapped = task.periodic is not None and flies[0] and flies[-1]
    lasts = [b - a for a, b in parts]
    if wrapped:
        lasts[0] = lasts[-1] = lasts[0] + lasts[-1]
    begin, end = (asked(requirements, "body/z", at) for at in (0.0, 1.0))
    first = ground[0] + (low if 0.0 in rests else top)
    t, z, vz = [0.0], [first if begin is None else begin], [0.0]
    if wrapped:
        z[0] = ground[0] + top + g * lasts[0] ** 2 / 8
    for i in range(1, len(parts)):
        up, down = flies[i], flies[i - 1]
        rises = (ground[i + 1] - ground[i]) / lasts[i] if up else 0.0
        rises += (ground[i] - ground[i - 1]) / lasts[i - 1] if down else 0.0
        speed = g * lasts[i] / 2 if up else -g * lasts[i - 1] / 2 if down else 0.0
        t.append(parts[i][0])
        z.append(ground[i] + top)
        vz.append(rises + speed)
    t.append(task.duration)
    last = ground[-1] + (low if 1.0 in rests else top) if end is None else end
    z.append(z[0] if task.periodic is not None else last)
    vz.append(0.0)
    return HeightCourse(t, z, vz, (0.0, 0.0))


def _load(parts: Sequence[tuple[float, float]], standing: Array, weight: float) -> Array:
    """What each standing foot bears (parts,) [N], so that stances carry the weight."""
    lasts = np.array([b - a for a, b in parts])
    count = standing.sum(axis=1)
    share = weight * lasts.sum() / max(lasts[count > 0].sum(), 1e-9)
    return np.asarray(share / np.maximum(count, 1))


def _foot(
    task: Task,
    parts: Sequence[tuple[float, float]],
    stands: Array,
    t: Array,
    hips: Array,
    reach: tuple[float, float],
    asked: Sequence[Requirement],
) -> Array:
    """Where a foot is (n, 2): on the ground below its hip's place in the middle of each stance, or
    the nearest place that is `asked` of it there, and swinging between, over all that stands there
    as far as the leg folds; turned with the body before its first and after its last stance."""
    runs: list[tuple[float, float]] = []
    for (begin, end), on in zip(parts, stands, strict=True):
        if on and runs and runs[-1][1] == begin:
            runs[-1] = runs[-1][0], end
        elif on:
            runs.append((begin, end))
    places = [float(np.interp((a + b) / 2, t, hips[:, 0])) for a, b in runs]
    for i, (a, b) in enumerate(runs):
        for r in asked:
            if r.at is not None and a <= r.at * task.duration <= b:
                places[i] = float(np.clip(places[i], r.lower, r.upper))
    if not runs:
        return hips - [0.0, reach[0] + FOLDED * (reach[1] - reach[0])]
    if task.periodic is not None:  # the strides before and after
        stride, last = hips[-1, 0] - hips[0, 0], task.duration
        (begin, end), (a, b) = runs[-1], runs[0]
        runs = [(begin - last, end - last), *runs, (a + last, b + last)]
        places = [places[-1] - stride, *places, places[0] + stride]
    heights = task.scene.skyline(np.array(places))
    x, z = np.full_like(t, places[0]), np.full_like(t, heights[0])
    for i, ((_, left), (down, _)) in enumerate(itertools.pairwise(runs)):
        swing = np.clip((t - left) / max(down - left, 1e-9), 0.0, 1.0)
        way, rise = places[i + 1] - places[i], heights[i + 1] - heights[i]
        ahead, inside = places[i] + way * WITHIN, np.sin(np.pi * WITHIN) ** 2
        over = task.scene.skyline(ahead) - heights[i] - rise * WITHIN
        if over.max() > 0.0:  # up first, then across
            across = _cycloid(WITHIN)
            over = task.scene.skyline(places[i] + way * across) - heights[i] - rise * WITHIN
            x += way * _cycloid(swing)
        else:
            x += way * swing
        bump = LIFT + max(0.0, float((over / inside).max()))
        z += rise * swing + bump * np.sin(np.pi * swing) ** 2
    if task.scene.cornered:  # folded, at most; where a body turns over, feet are above their hips
        z = np.minimum(z, hips[:, 1] - reach[0])
    return np.column_stack([x, z])


def _cycloid(share: Array) -> Array:
    """The way of a motion that rests at both ends, at shares of its time, from 0 to 1."""
    return np.asarray(share - np.sin(2.0 * np.pi * share) / (2.0 * np.pi))


STEP = 1e-4  # rad, of the knee in differences: near the cube root of the rounding error
FILLED = 300.0 / 324.0  # of the steady force, which a moving piston does not reach
FILLING = 0.6  # time constant, of the fill time at full stroke: mid-push is 15 of 25 ms (Table I)


def leg_pose(robot: Robot, fold: int, dx: np.ndarray, dz: np.ndarray) -> tuple[np.ndarray, ...]:
    """Hip angle and flexion [rad] (n,) that put the foot at (dx, dz) from the hip [m]."""
    f, t = robot.leg.femur.length, robot.leg.tibia.length
    bends = sorted(flexion(robot.leg, x) for x in (0.0, robot.stroke))
    length = np.hypot(dx, dz)
    cosine = np.clip((length**2 - f**2 - t**2) / (2 * f * t), -1, 1)
    bend = np.clip(np.arccos(cosine), bends[0], bends[1])
    lean = np.arctan2(t * np.sin(bend), f + t * np.cos(bend))
    return np.arctan2(dx, -dz) - fold * lean, bend


def automatic_guess(
    model: Model, task: Task, requirements: Sequence[Requirement], layout: Layout, nodes: int
) -> np.ndarray:
    """Start guess Y (nodes + 1, n) in the layout's scaled coordinates."""
    robot = model.mechanism.need_robot()
    if not task.contacts:
        requirements = [r for r in requirements if r.minus is None]
    t = np.linspace(0.0, task.duration, nodes + 1)
    low, high = (float(_length(robot, flexion(robot.leg, x))) for x in (0.0, robot.stroke))
    course = (in_order if task.contacts else jump)(model, task, requirements, t, (low, high))

    names = [c.name for c in model.mechanism.coordinates]
    q = np.zeros((nodes + 1, len(names)))
    for name, values in (("x", course.x), ("z", course.z), ("pitch", course.pitch)):
        q[:, names.index(f"body/{name}")] = values
    cos, sin = np.cos(course.pitch), np.sin(course.pitch)
    forces: dict[str, np.ndarray] = {}
    for leg, place in robot.legs.items():
        dx, dz = course.feet[leg].T
        ahead, below = cos * dx + sin * dz, cos * dz - sin * dx  # in the body's frame
        hip, bend = leg_pose(robot, place.fold, ahead, below)
        q[:, names.index(f"{leg}/hip/q")] = hip
        q[:, names.index(f"{leg}/knee/q")] = place.fold * bend
        forces[leg] = course.load[leg] * _lever(robot, bend)
    v, h = np.asarray(np.gradient(q, t, axis=0)), np.full((nodes + 1, 1), task.duration / nodes)
    Y = layout.pack({"q": q, "v": v, "h": h, **_efforts(model, t, forces, course.load)})
    if task.guess_noise:
        rng = np.random.default_rng(task.seed)
        Y = Y + task.guess_noise * rng.normal(size=Y.shape)
    return np.asarray(np.clip(Y, layout.lower, layout.upper))


def _lever(robot: Robot, bend: np.ndarray) -> np.ndarray:
    """Piston force per vertical foot force: dz/dx of the leg, by virtual work."""
    ahead, behind = ([extension(robot.leg, k + d) for k in bend] for d in (STEP, -STEP))
    dx = np.array(ahead, float) - np.array(behind, float)
    return np.asarray((_length(robot, bend + STEP) - _length(robot, bend - STEP)) / dx)


def _length(robot: Robot, bend: Any) -> Any:
    """Distance [m] from hip to foot at flexions [rad]."""
    f, b = robot.leg.femur.length, robot.leg.tibia.length
    return np.hypot(f + b * np.cos(bend), b * np.sin(bend))


def _efforts(
    model: Model, t: np.ndarray, piston: dict[str, np.ndarray], load: dict[str, np.ndarray]
) -> dict[str, np.ndarray]:
    s = np.tile([q.value for q in model.states.values()], (len(t), 1))
    u = np.zeros((len(t), len(model.inputs)))
    lam = np.zeros((len(t), len(model.forces)))
    cylinder = model.mechanism.need_cylinder()
    full = FILLED * float(np.interp(model.supply, cylinder.pressures, cylinder.F_extend))
    rise = FILLING * max(cylinder.fill)
    for i, (leg, symbol) in enumerate(model.states):
        if symbol == "F_e" and leg in piston:
            s[:, i] = np.clip(piston[leg], 0.0, full)
    for i, (leg, symbol) in enumerate(model.inputs):
        if symbol == "u_e" and leg in piston:  # eq. 4 solved for the valve
            u[:, i] = np.clip((piston[leg] + rise * np.gradient(piston[leg], t)) / full, 0.0, 1.0)
    for i, (leg, symbol) in enumerate(model.forces):
        if symbol == "lam_n" and leg in load:
            lam[:, i] = load[leg]
    return {"s": s, "u": u, "lam": lam}
