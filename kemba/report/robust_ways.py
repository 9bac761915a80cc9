"""In which ways a motion is sought so that it succeeds more often."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from kemba.effects.mechanics.contact import Contact
from kemba.model import Model
from kemba.ocp import Plan, Task
from kemba.ocp.certificate.grip import grip_of
from kemba.scenarios.draw import Scenario
from kemba.settings import Settings, setting

TRIALS = "tuned: by hand on jumps of 0.36 to 0.9 m (docs/tasks.md), no benchmark"


class RobustSettings(Settings):
    """Which plans are tried, and when one is good enough."""

    enough: float = setting(0.98, "1", "share of scenarios at which no other plan is tried", TRIALS)
    hold: float = setting(
        0.3, "s", "hold of a plan whose task has none",
        "derived: a robot that was put down askew has settled by then (docs/tasks.md)",
    )  # fmt: skip
    longer: float = setting(
        0.15, "1", "more time for a plan that takes all it has, as a share",
        "tuned: a jump of 0.9 m, which has 0.84 s, takes 0.91 s where it may",
    )  # fmt: skip
    full: float = setting(
        1e-3, "1", "of the longest time, by which a plan that takes all of it is shorter at most",
        "convention: IPOPT ends that near to a bound",
    )  # fmt: skip
    air: float = setting(0.3, "1", "cost of open valves of a candidate that has less", TRIALS)
    noise: float = setting(0.1, "1", "guess noise of other starts", TRIALS)
    starts: int = setting(1, "1", "other starts", "convention: three times a plain plan at most")


def changes(task: Task, found: Plan, cases: Sequence[Scenario]) -> Iterator[tuple[str, Task]]:
    """What the plan of `task` may be continued for, with words for the plan's sentence.

    First what the scenarios' ground holds, within the task; then more time than the task gives.
    """
    settings = RobustSettings.current()
    grip = least_grip(found.model, cases)
    used = grip_of(found.model, found.trajectory) or 0.0
    sure = task.model_copy(update={"grip": min(task.grip, grip)})
    if used > sure.grip:
        yield f"on {sure.grip:.0%} of the ground's friction", sure
    longest = task.duration * (1.0 + task.step_variation)
    if found.trajectory.time[-1] >= longest * (1.0 - settings.full):
        duration = task.duration * (1.0 + settings.longer)
        longer = sure.model_copy(update={"duration": duration})
        yield f"with a duration of {duration:.3g} s instead of {task.duration:g} s", longer


def variants(task: Task) -> Iterator[tuple[str, Task]]:
    """The same motion sought anew."""
    settings = RobustSettings.current()
    held = task.model_copy(update={"hold": max(task.hold, settings.hold)})
    if task.cost.get("air", 0.0) < settings.air:
        yield "with less air", held.model_copy(update={"cost": {**task.cost, "air": settings.air}})
    for seed in range(1, settings.starts + 1):
        guess = {"guess_noise": max(task.guess_noise, settings.noise), "seed": task.seed + seed}
        yield "from another start", held.model_copy(update=guess)


def least_grip(model: Model, cases: Sequence[Scenario]) -> float:
    """The share of the friction of `model` that the ground has in all scenarios but those that
    need not succeed; 1 where it varies in none."""
    own = _friction(model)
    there = [f for f in (_friction(case.model) for case in cases) if f is not None]
    if not own or not there:
        return 1.0
    sure = float(np.quantile(there, 1.0 - RobustSettings.current().enough))
    return min(1.0, sure / own)


def _friction(model: Model) -> float | None:
    ground = next((e for e in model.effects if isinstance(e, Contact)), None)
    return None if ground is None else float(ground.value("mu"))
