"""Automatic start guess.

The body's height rests, is pushed, flies and lands, in one dimension. Legs follow by inverse
kinematics with the feet under the hips, forces and valves by virtual work.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from kemba.mechanism import Robot
from kemba.mechanism.knee import extension, flexion
from kemba.model import Model
from kemba.ocp.relaxation.settings import Guess
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import Task
from kemba.ocp.task.terrain import ground_at
from kemba.ocp.transcription.layout import Layout


@dataclass(frozen=True)
class HeightCourse:
    """Knots of the body's height: times [s], heights [m], rates [m.s-1], and the flight's span."""

    t: list[float]
    z: list[float]
    vz: list[float]
    flight: tuple[float, float]

    def __call__(self, t: np.ndarray, order: int = 0) -> np.ndarray:
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
    """The value required of a quantity at a moment, or None; of a range its lower end, if any."""
    for requirement in requirements:
        if requirement.quantity.name == name and requirement.at == at:
            return requirement.lower if np.isfinite(requirement.lower) else requirement.upper
    return None


def body_course(
    requirements: Sequence[Requirement],
    duration: float,
    reach: tuple[float, float],
    g: float,
    ground: tuple[float, float] = (0.0, 0.0),
) -> HeightCourse:
    """Height of the body over the motion; `reach` = leg length retracted and stretched [m],
    `ground` = height [m] where it starts and where it ends."""
    settings, (first, last) = Guess.current(), ground
    low, high = reach[0] + first, reach[1] + first
    top = low + settings.stretch * (high - low)
    lands_at, bent = top + last - first, low + settings.landing * (top - low) + last - first
    z0 = asked(requirements, "body/z", 0.0) or low
    z1 = asked(requirements, "body/z", 1.0)
    peaks = [
        w for w in requirements if w.quantity.name == "body/z" and w.at and np.isfinite(w.lower)
    ]
    peak = max(peaks, key=lambda w: w.lower, default=None)
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
    if apex <= top:
        course = HeightCourse([0.0, t_apex], [z0, apex], [0.0, 0.0], (t_apex, t_apex))
    else:
        longest = settings.rise * t_apex
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
    t = np.linspace(0.0, task.duration, nodes + 1)
    lengths = [
        np.hypot(f + b * np.cos(k), b * np.sin(k))
        for f, b in [(robot.leg.femur.length, robot.leg.tibia.length)]
        for k in (flexion(robot.leg, x) for x in (0.0, robot.stroke))
    ]
    gravity, scene = model.mechanism.gravity, model.mechanism.scene
    ground = ground_at(model, requirements, 0.0), ground_at(model, requirements, 1.0)
    if task.guess == "standing":
        still = task.duration
        course = HeightCourse([0.0, still], [lengths[0] + ground[0]] * 2, [0.0] * 2, (still, still))
    else:
        reach = (lengths[0], lengths[1])
        course = body_course(requirements, task.duration, reach, gravity, ground)
    z, az = course(t), course(t, 2)
    airborne = (t > course.flight[0]) & (t < course.flight[1])
    x0 = asked(requirements, "body/x", 0.0) or 0.0
    x1 = asked(requirements, "body/x", 1.0)
    x1 = x0 if x1 is None else x1
    span = max(course.flight[1] - course.flight[0], Guess.current().least_flight)
    x = x0 + (x1 - x0) * np.clip((t - course.flight[0]) / span, 0.0, 1.0)

    names = [c.name for c in model.mechanism.coordinates]
    q = np.zeros((nodes + 1, len(names)))
    q[:, names.index("body/x")], q[:, names.index("body/z")] = x, z
    load = np.where(airborne, 0.0, model.mechanism.mass * np.maximum(az + gravity, 0.0))
    share = load / len(robot.legs)
    forces: dict[str, np.ndarray] = {}
    for leg, place in robot.legs.items():
        stretched = lengths[0] + Guess.current().stretch * (lengths[1] - lengths[0])
        foot = x + place.hip
        low = np.where(airborne, scene.skyline(foot), scene.ground.height(foot))
        length = np.minimum(z - low, stretched)
        hip, bend = leg_pose(robot, place.fold, np.zeros_like(z), -length)
        q[:, names.index(f"{leg}/hip/q")] = hip
        q[:, names.index(f"{leg}/knee/q")] = place.fold * bend
        forces[leg] = share * _lever(robot, bend)
    v = np.asarray(np.gradient(q, t, axis=0))
    groups: dict[str, np.ndarray] = {
        "q": q,
        "v": v,
        "h": np.full((nodes + 1, 1), task.duration / nodes),
    }
    groups |= _efforts(model, t, forces, share)
    Y = layout.pack(groups)
    if task.guess_noise:
        rng = np.random.default_rng(task.seed)
        Y = Y + task.guess_noise * rng.normal(size=Y.shape)
    return np.asarray(np.clip(Y, layout.lower, layout.upper))


def _lever(robot: Robot, bend: np.ndarray) -> np.ndarray:
    """Piston force per vertical foot force: dz/dx of the leg, by virtual work."""
    f, b = robot.leg.femur.length, robot.leg.tibia.length

    def length(k: np.ndarray) -> np.ndarray:
        return np.asarray(np.hypot(f + b * np.cos(k), b * np.sin(k)))

    step = Guess.current().difference
    ahead, behind = ([extension(robot.leg, k + d) for k in bend] for d in (step, -step))
    dx = np.array(ahead, float) - np.array(behind, float)
    return np.asarray((length(bend + step) - length(bend - step)) / dx)


def _efforts(
    model: Model, t: np.ndarray, piston: dict[str, np.ndarray], share: np.ndarray
) -> dict[str, np.ndarray]:
    s = np.tile([q.value for q in model.states.values()], (len(t), 1))
    u = np.zeros((len(t), len(model.inputs)))
    lam = np.zeros((len(t), len(model.forces)))
    cylinder = model.mechanism.need_cylinder()
    settings = Guess.current()
    full = settings.filled * float(np.interp(model.supply, cylinder.pressures, cylinder.F_extend))
    rise = settings.filling * max(cylinder.fill)
    for i, (leg, symbol) in enumerate(model.states):
        if symbol == "F_e" and leg in piston:
            s[:, i] = np.clip(piston[leg], 0.0, full)
    for i, (leg, symbol) in enumerate(model.inputs):
        if symbol == "u_e" and leg in piston:  # eq. 4 solved for the valve
            u[:, i] = np.clip((piston[leg] + rise * np.gradient(piston[leg], t)) / full, 0.0, 1.0)
    for i, (_, symbol) in enumerate(model.forces):
        if symbol == "lam_n":
            lam[:, i] = share
    return {"s": s, "u": u, "lam": lam}
