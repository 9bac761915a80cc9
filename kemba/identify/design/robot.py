"""The next motion of a robot: the safe sway that tells the rivals of an answer apart best.

The feet stand, the valves stay closed, the hips lean the body to and fro by a few centimetres, each
lean faster or slower than the one before. A sway is known by its ways and times alone, so that it
can be tried on the simulation before any plan is made; the task asks for the same ways at the same
times, and planning finds the torques.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import qmc

from kemba.config import dump_yaml
from kemba.effects.mechanics.hip import Motor
from kemba.errors import KembaError
from kemba.identify.answer import read_answer
from kemba.identify.design.separation import (
    DesignSearchSettings,
    ExperimentSettings,
    JudgedTest,
    Proposal,
    Rivals,
    Separation,
    contenders,
    separation,
    strength,
)
from kemba.identify.problem.problem import Array
from kemba.identify.robot.problem import robot_problem
from kemba.model.model import Model
from kemba.model.spec import load_model
from kemba.plant.controller import PERIOD, execute
from kemba.plant.repeat import Sensors, take_log
from kemba.stopwatch import Tell, silent
from kemba.trajectory import Trajectory

# What a robot may do in a designed motion.
LEAST = 0.03  # smallest lean of the hips [rad]
MOST = 0.25  # largest lean of the hips [rad]: 4 cm of the body
# largest acceleration of the body [m.s-2]: feet of the shipped robot slip at about 10
ACCELERATION = 8.0
LEANS = 6  # most leans
SHORTEST = 0.5  # shortest sway [s]
LONGEST = 0.9  # longest sway [s]: plans of up to so long replay without feedback
PACE = 1.5  # most by which a lean is longer than the one before
HOLD = 0.3  # rest before the motion [s]: as the shipped tasks
NODES = 50  # nodes of the task per second: steps of 20 ms
FEWEST = 30  # fewest nodes of the task
KNEE = 0.02  # least height of the knees [m]: as the hop
SLIP = 2e-3  # way of a foot that counts as slipping [m]: boom noise, 6 sigma
LOAD = 0.15  # least load of a foot, as a share of half the weight: margin
EFFORT = 0.8  # largest torque of a hip, as a share of its peak: margin
TRIED = 12  # motions that are tried: a minute
LEAST_TRIED = 6  # motions that are tried on the slowest machine
ROWS = 500.0  # rows per second of the simulated logs [Hz]


@dataclass(frozen=True)
class Sway:
    """Leans of the hips by `angle` [rad] to either side in turn, `leans` of them in `duration` [s].

    `pace`: how much longer each lean lasts than the one before; below 1 they become faster.
    """

    angle: float
    leans: int
    duration: float
    pace: float

    @property
    def ends(self) -> Array:
        """Times (leans + 1,) [s] at which the leans, and the way back, end."""
        parts = self.pace ** np.arange(self.leans + 1)
        parts[0] *= 0.7  # half the way of the others,
        parts[-1] *= 0.7  # at the same acceleration
        return np.asarray(self.duration * np.cumsum(parts) / parts.sum())

    def lean(self, times: Array) -> tuple[Array, Array]:
        """Angle [rad] and rate [rad.s-1] (m,) at `times` (m,) [s]; at rest at every turn."""
        knots = np.concatenate([[0.0], self.ends])
        ways = self.angle * np.array([0.0, *(1.0 - 2.0 * (i % 2) for i in range(self.leans)), 0.0])
        piece = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, self.leans)
        length = np.diff(knots)[piece]
        s = np.clip((times - knots[piece]) / length, 0.0, 1.0)
        way = np.diff(ways)[piece]
        angle = ways[piece] + way * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        return angle, way * 30.0 * s**2 * (1.0 - s) ** 2 / length


def controller(model: Model, sway: Sway) -> Trajectory:
    """The controller's table that sways a robot from its standing pose by its hip gains alone."""
    times = np.arange(round((HOLD + sway.duration) / PERIOD) + 1) * PERIOD - HOLD
    angle, rate = sway.lean(np.clip(times, 0.0, None))
    columns: dict[str, Array] = {}
    for leg in model.mechanism.legs:
        pose = model.mechanism.standing[f"{leg}/hip/q"]
        columns[f"{leg}/hip/q [rad]"], columns[f"{leg}/hip/w [rad.s-1]"] = pose + angle, rate
        columns[f"{leg}/hip/tau [N.m]"] = np.zeros(len(times))
        for valve in ("extend", "retract"):
            columns[f"{leg}/valve/{valve} [1]"] = np.zeros(len(times))
    return Trajectory(times, columns, {"kind": "controller", "lead": HOLD})


def task(model: Model, name: str, sway: Sway, done: Trajectory, notes: str) -> dict[str, Any]:
    """The task of a sway that was simulated as `done`: the same ways at the same times."""
    nodes = max(round(NODES * sway.duration), FEWEST)
    leg = next(iter(model.mechanism.legs))
    still = {"rest": True, "body/x": "0 m", "body/pitch": "0 deg", "*/foot/z": "0 m"}
    hip = float(model.mechanism.standing[f"{leg}/hip/q"])
    goals = {}
    for i, end in enumerate(sway.ends[:-1]):
        way = float(np.interp(end, done.time, done["body/x"]))
        at = float(round(end / sway.duration * nodes) / nodes)
        goals[f"lean_{i + 1}"] = {"quantity": "body/x", "at": at, "equals": f"{1e3 * way:.1f} mm"}
    pose = {"*/piston/x": "0 m", f"{leg}/hip/q": f"{hip:.4f} rad", "settled": True}
    return {
        "name": "sway",
        "notes": notes,
        "model": name,
        "duration": f"{sway.duration:.3f} s",
        "nodes": nodes,
        "hold": f"{HOLD:g} s",
        "start": {**still, **pose},
        "end": still,
        "bounds": {
            "*/foot/z": {"at_most": "0 m"},
            "*/piston/x": {"at_most": "0 m"},
            "*/valve/*": {"at_most": 0},
            "*/knee/z": {"at_least": f"{1e3 * KNEE:g} mm"},
        },
        "goals": goals,
        "cost": {"torque_squared": 1},
    }


# a slow lean to both sides: what one would do without a design
STANDARD = Sway(angle=0.1, leans=2, duration=0.9, pace=1.0)


@dataclass(frozen=True)
class Tried(JudgedTest):
    """A sway as it was simulated."""

    test: Sway
    done: Trajectory


def _design_motion(
    model: Model, rivals: Rivals, say: Tell
) -> tuple[Tried, list[Tried], int] | None:
    """The standard sway, all safe ones, the best first, and how many were simulated."""
    if len(model.mechanism.legs) < 2:
        raise KembaError(model.name, "stands on one leg; no safe motion is known for it")
    search = DesignSearchSettings
    started, count = time.monotonic(), 0
    found: list[Tried] = []
    standard: Tried | None = None
    height = float(model.mechanism.standing["body/z"])
    rng, even = np.random.default_rng(search.seed), max((2 * TRIED) // 3, 1)
    cube = qmc.Sobol(4, rng=search.seed).random_base2(int(np.ceil(np.log2(even))))
    points = {STANDARD: np.full(4, 0.5)}
    while count < TRIED:  # the standard, some that fill the range, some near the best
        if count >= LEAST_TRIED and time.monotonic() - started > search.budget:
            break
        if count <= even:
            point = cube[count - 1]
        else:
            near = points[found[0].test] if found else np.full(4, 0.5)
            point = np.clip(near + 0.15 * rng.standard_normal(4), 0.0, 1.0)
        sway = _sway(point, height) if count else STANDARD
        points.setdefault(sway, point)
        count += 1
        tried = try_out(model, sway, rivals)
        if tried is None:
            continue
        if tried.first == "":
            return None
        standard = standard or tried
        found.append(tried)
        found.sort(key=lambda t: -t.worth)
        say(f"{count} motions tried; the best is worth {found[0].worth:.2f}")
    if standard is None:
        raise KembaError(model.name, "no sway that was tried is safe", "feet that stand, knees up")
    return standard, found, count


def try_out(model: Model, sway: Sway, rivals: Rivals) -> Tried | None:
    """A sway on the simulation; None where it is not safe."""
    try:
        done = execute(controller(model, sway), model, sample=1.0 / ROWS).trajectory
    except KembaError:
        return None
    if not safe(model, done):
        return None
    log_s = float(done.time[-1] - done.time[0])  # the rest before it included
    found = expected(model, done, rivals)
    return Tried(found.first, found.nats, sway, log_s, done)


def expected(model: Model, done: Trajectory, rivals: Rivals) -> Separation:
    """The evidence that a log of a motion is expected to hold, with the usual sensors."""
    log = take_log(done, Sensors.usual(), np.random.default_rng(0), model.effects)
    log.meta["name"] = "designed"
    found = separation(robot_problem([log], model), rivals)
    return found if found is not None else Separation("", {})


def safe(model: Model, done: Trajectory) -> bool:
    """Whether feet stand and carry, knees stay up, and hips have torque to spare, all the time."""
    legs = model.mechanism.legs
    share = 0.5 * model.mechanism.weight * LOAD
    peak = {e.on: e.tau_peak for e in model.effects if isinstance(e, Motor)}
    for leg in legs:
        most = EFFORT * peak.get(leg, peak.get(None, np.inf))
        if np.ptp(done[f"{leg}/foot/x"]) > SLIP or done[f"{leg}/foot/Fz"].min() < share:
            return False
        if done[f"{leg}/knee/z"].min() < KNEE:
            return False
        if np.abs(done[f"{leg}/hip/tau"]).max() > most:
            return False
    return True


def _sway(point: Array, height: float) -> Sway:
    """The sway of a point (4,) of the unit cube, its acceleration limited for hips at `height`."""
    plain = Sway(
        angle=1.0,
        leans=1 + min(int(point[1] * LEANS), LEANS - 1),
        duration=round(SHORTEST + (LONGEST - SHORTEST) * float(point[2]), 3),
        pace=round(PACE ** (2.0 * float(point[3]) - 1.0), 4),
    )
    _, rate = plain.lean(np.linspace(0.0, plain.duration, 500))
    fastest = float(np.abs(np.gradient(rate, plain.duration / 499)).max())
    angle = LEAST * (MOST / LEAST) ** float(point[0])
    return replace(plain, angle=round(min(angle, ACCELERATION / (height * fastest)), 4))


@dataclass(frozen=True)
class MotionProposal(Proposal):
    """A proposal of sways: safe `motions`, the best one first."""

    motions: Sequence[Tried]
    model: Model
    base: str
    rivals: Rivals

    @property
    def repeats(self) -> int | None:
        """Runs until the evidence is decisive; None where that would be too many."""
        count = math.ceil(ExperimentSettings.clear / max(self.nats, 1e-9))
        return count if count <= ExperimentSettings.repeats else None

    @property
    def sentence(self) -> str:
        """What the motion gains, in words."""
        first, second = self.pair
        best, standard = self.designed, self.standard
        what = f"A sway of {best.test.duration:.2g} s with {best.test.leans} leans"
        gives = f"{strength(self.nats)} evidence between {first} and {second}"
        if self.repeats is None:
            return (
                f"{what} is the best of {self.tried} safe motions, and is expected to give "
                f"{gives}: feet that stand and pistons at rest do not tell these two apart. Try "
                "the rig (--on rig), or a jump."
            )
        again = "" if self.repeats == 1 else f" in one run, and decisive in {self.repeats}"
        text = f"{what} is expected to give {gives}{again}"
        if best is standard:
            return f"{text}; no other motion that was tried gives more."
        ratio = best.pace / max(standard.pace, 1e-9)
        return f"{text}, {ratio:.2g} times as much per second as a slow lean to both sides."

    def json(self) -> dict[str, Any]:
        """The same with the runs that it takes."""
        return {"motion": "sway", "repeats": self.repeats, **super().json()}

    def write(self, out: Path, tried: Tried) -> None:
        """One of the motions as a task YAML. Raises KembaError."""
        notes = self.sentence if tried is self.designed else "the next best motion"
        dump_yaml(task(self.model, self.base, tried.test, tried.done, notes), out)

    def nats_of(self, run: str | Path) -> float:
        """Expected evidence [nats] of the plan in a run folder."""
        done = execute(run, self.model, sample=1.0 / ROWS).trajectory
        return expected(self.model, done, self.rivals).least


def propose_motion(folder: str | Path, out: Path, say: Tell = silent) -> MotionProposal:
    """The safe motion that best tells the possible effects of an answer apart, a task in `out`,
    found in about a minute. Raises KembaError where no motion shows a difference, or a file cannot
    be read or written."""
    answer = read_answer(folder)
    rivals, base = contenders(answer), str(answer.get("base") or "planning")
    model = load_model(base)
    if model.mechanism.rig or not model.mechanism.robot:
        raise KembaError(str(folder), f"its model {model.name} is no robot")
    design = _design_motion(model, rivals, say)
    if design is None:
        names = ", ".join(rivals.names)
        raise KembaError(str(folder), f"no log of the robot shows a difference between {names}")
    standard, motions, tried = design
    found = MotionProposal(standard, motions[0], tried, motions, model, base, rivals)
    found.write(out, motions[0])
    return found
