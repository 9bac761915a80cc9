"""The designed motion of a robot: the safe sway that tells rivals apart best."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from kemba.effects.mechanics.motor import Motor
from kemba.errors import KembaError
from kemba.identify.design.motions import Sway, controller
from kemba.identify.design.rivals import Rivals
from kemba.identify.design.separation import Separation, separation
from kemba.identify.design.settings import DesignSearchSettings, SwaySettings
from kemba.identify.problem.problem import Array
from kemba.identify.robot.problem import robot_problem
from kemba.model.model import Model
from kemba.plant.controller import execute
from kemba.plant.repeat import Sensors, take_log
from kemba.trajectory import Trajectory

# a slow lean to both sides: what one would do without a design
STANDARD = Sway(angle=0.1, leans=2, duration=0.9, pace=1.0)


@dataclass(frozen=True)
class Tried:
    """A sway as it was simulated, with its expected evidence and the seconds of its log."""

    sway: Sway
    done: Trajectory
    evidence: Separation

    @property
    def log_s(self) -> float:
        """Seconds of log, the rest before it included."""
        return float(self.done.time[-1] - self.done.time[0])

    @property
    def pace(self) -> float:
        """Expected evidence [nats] per second of log."""
        return self.evidence.least / self.log_s


@dataclass(frozen=True)
class RobotDesign:
    """The standard sway, and the best ones first; `tried` of them were simulated."""

    standard: Tried
    best: tuple[Tried, ...]
    tried: int


def design_motion(
    model: Model,
    rivals: Rivals,
    say: Callable[[str], None] = lambda text: None,
    bounded: bool = True,
) -> RobotDesign | None:
    """The sways that tell the rivals apart best. `bounded`: in about a minute.

    None where logs of a robot cannot show two of the rivals. Raises KembaError where the robot has
    one leg, or none of the sways is safe.
    """
    if len(model.mechanism.legs) < 2:
        raise KembaError(model.name, "stands on one leg; no safe motion is known for it")
    settings, search = SwaySettings, DesignSearchSettings
    started, count = time.monotonic(), 0
    found: list[Tried] = []
    standard: Tried | None = None
    height = float(model.mechanism.standing["body/z"])
    for sway in _sways(settings.tried, search.seed, height, lambda: found):
        if bounded and count >= settings.least_tried and time.monotonic() - started > search.budget:
            break
        count += 1
        tried = try_out(model, sway, rivals)
        if tried is None:
            continue
        if tried.evidence.first == "":
            return None
        standard = standard or tried
        found.append(tried)
        found.sort(key=lambda t: -t.evidence.worth)
        say(f"{count} motions tried; the best is worth {found[0].evidence.worth:.2f}")
    if standard is None:
        raise KembaError(model.name, "no sway that was tried is safe", "feet that stand, knees up")
    return RobotDesign(standard, tuple(found), count)


def try_out(model: Model, sway: Sway, rivals: Rivals) -> Tried | None:
    """A sway on the simulation; None where it is not safe."""
    settings = SwaySettings
    try:
        done = execute(controller(model, sway), model, sample=1.0 / settings.rows).trajectory
    except KembaError:
        return None
    if not safe(model, done):
        return None
    return Tried(sway, done, expected(model, done, rivals))


def expected(model: Model, done: Trajectory, rivals: Rivals) -> Separation:
    """The evidence that a log of a motion is expected to hold, with the usual sensors."""
    log = take_log(done, Sensors.usual(), np.random.default_rng(0), model.effects)
    log.meta["name"] = "designed"
    found = separation(robot_problem([log], model), rivals)
    return found if found is not None else Separation("", {})


def expected_of_run(run: str | Path, model: Model, rivals: Rivals) -> Separation:
    """The same of a run folder's plan."""
    done = execute(run, model, sample=1.0 / SwaySettings.rows).trajectory
    return expected(model, done, rivals)


def safe(model: Model, done: Trajectory) -> bool:
    """Whether feet stand and carry, knees stay up, and hips have torque to spare, all the time."""
    settings, legs = SwaySettings, model.mechanism.legs
    share = 0.5 * model.mechanism.weight * settings.load
    peak = {e.on: e.tau_peak for e in model.effects if isinstance(e, Motor)}
    for leg in legs:
        most = settings.effort * peak.get(leg, peak.get(None, np.inf))
        if np.ptp(done[f"{leg}/foot/x"]) > settings.slip or done[f"{leg}/foot/Fz"].min() < share:
            return False
        if done[f"{leg}/knee/z"].min() < settings.knee:
            return False
        if np.abs(done[f"{leg}/hip/tau"]).max() > most:
            return False
    return True


def _sways(count: int, seed: int, height: float, best: Callable[[], list[Tried]]) -> Iterator[Sway]:
    """The standard sway, then some that fill the range evenly, then some near the best."""
    from scipy.stats import qmc

    rng = np.random.default_rng(seed)
    even = max((2 * count) // 3, 1)
    points = qmc.Sobol(4, rng=seed).random_base2(int(np.ceil(np.log2(even))))
    yield STANDARD
    for point in points[:even]:
        yield _sway(point, height)
    for _ in range(count - even - 1):
        found = best()
        near = _point(found[0].sway) if found else np.full(4, 0.5)
        yield _sway(np.clip(near + 0.15 * rng.standard_normal(4), 0.0, 1.0), height)


def _sway(point: Array, height: float) -> Sway:
    """The sway of a point (4,) of the unit cube, of hips at this height [m]; its angle is as large
    as the acceleration allows, where that is less."""
    s = SwaySettings
    plain = Sway(
        angle=1.0,
        leans=1 + min(int(point[1] * s.leans), s.leans - 1),
        duration=round(s.shortest + (s.longest - s.shortest) * float(point[2]), 3),
        pace=round(s.pace ** (2.0 * float(point[3]) - 1.0), 4),
    )
    _, rate = plain.lean(np.linspace(0.0, plain.duration, 500))
    fastest = float(np.abs(np.gradient(rate, plain.duration / 499)).max())
    angle = s.least * (s.most / s.least) ** float(point[0])
    return replace(plain, angle=round(min(angle, s.acceleration / (height * fastest)), 4))


def _point(sway: Sway) -> Array:
    """The point (4,) of a sway, in the middle of its number of leans."""
    s = SwaySettings
    return np.array(
        [
            np.log(sway.angle / s.least) / np.log(s.most / s.least),
            (sway.leans - 0.5) / s.leans,
            (sway.duration - s.shortest) / (s.longest - s.shortest),
            0.5 + 0.5 * np.log(sway.pace) / np.log(s.pace),
        ]
    )
