"""Automatic start guess.

The body and the feet follow a course in outline, see `course`; legs follow by inverse kinematics,
forces and valves by virtual work.
"""

from collections.abc import Sequence

import numpy as np

from kemba.mechanism import Robot
from kemba.mechanism.knee import extension, flexion
from kemba.model import Model
from kemba.ocp.relaxation.course import in_order, jump
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.layout import Layout

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
    f, b = robot.leg.femur.length, robot.leg.tibia.length
    bends = [flexion(robot.leg, x) for x in (0.0, robot.stroke)]
    low, high = (float(np.hypot(f + b * np.cos(k), b * np.sin(k))) for k in bends)
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
    v = np.asarray(np.gradient(q, t, axis=0))
    groups: dict[str, np.ndarray] = {
        "q": q,
        "v": v,
        "h": np.full((nodes + 1, 1), task.duration / nodes),
    }
    groups |= _efforts(model, t, forces, course.load)
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

    ahead, behind = ([extension(robot.leg, k + d) for k in bend] for d in (STEP, -STEP))
    dx = np.array(ahead, float) - np.array(behind, float)
    return np.asarray((length(bend + STEP) - length(bend - STEP)) / dx)


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
