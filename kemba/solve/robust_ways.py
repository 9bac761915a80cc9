"""In which ways a motion is sought so that it succeeds more often."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from kemba.effects.mechanics.contact import Contact
from kemba.model import Model
from kemba.ocp import Plan, Task
from kemba.ocp.certificate.grip import grip_of
from kemba.scenarios.draw import Scenario

Changed = tuple[str, Task] | None  # the changed task, and words for the sentence of its plan
# share of scenarios at which no other plan is sought; by hand on jumps of 0.36 to 0.9 m
# (docs/tasks.md), as AIR and NOISE
ENOUGH = 0.98
# scenarios in which a plan is executed first; in the others at once only if it succeeds in all of
# these: one that succeeds in 98 % does so three times in four, one of 90 % once in five
FEW = 15
HOLD = 0.3  # s; of a plan whose task has none: a robot that was put down askew has settled by then
# more time for a plan that takes all it has, as a share: a jump of 0.9 m, which has 0.84 s, takes
# 0.91 s where it may
LONGER = 0.15
FULL = 1e-3  # of the longest time, by which a plan that takes all of it is shorter at most
# m; more height of knees and hips above the ground, where the task asks for some: of jump_forward
# 95 % land with 5 cm under the knees, all of 120 with 8 to 11 cm (by hand)
ROOM = 0.05
AIR = 0.3  # cost of open valves of a candidate that has less
NOISE = 0.1  # guess noise of other starts
STARTS = 1  # other starts: three times a plain plan at most


def gripping(found: Plan, cases: Sequence[Scenario]) -> Changed:
    """What a plan is continued for where it leans on more friction than the scenarios have."""
    task, grip = found.task, least_grip(found.model, cases)
    if (grip_of(found.model, found.trajectory) or 0.0) <= grip:
        return None
    return f"on {grip:.0%} of the ground's friction", task.model_copy(update={"grip": grip})


def lifted(found: Plan, cases: Sequence[Scenario]) -> Changed:
    """What a plan is continued for where its task keeps knees or hips above the ground: that they
    keep off it by more, since a landing askew lowers one of them."""
    task = found.task
    bounds = {}
    for r in found.requirements:
        where, name = str(r.location[0]), str(r.location[-1])
        if where == "bounds" and r.quantity.name.endswith("/z") and np.isfinite(r.lower):
            bounds[name] = task.bounds[name].model_copy(update={"at_least": r.lower + ROOM})
    if not bounds:
        return None
    words = f"with {100 * ROOM:g} cm more room under knees and hips"
    return words, task.model_copy(update={"bounds": {**task.bounds, **bounds}})


def longer(found: Plan, cases: Sequence[Scenario]) -> Changed:
    """What a plan is continued for where it takes all the time that its task has."""
    task = found.task
    longest = task.duration * (1.0 + task.step_variation)
    if found.trajectory.time[-1] < longest * (1.0 - FULL):
        return None
    duration = task.duration * (1.0 + LONGER)
    words = f"with a duration of {duration:.3g} s instead of {task.duration:g} s"
    return words, task.model_copy(update={"duration": duration})


# in which order a plan is changed: first by what helps one that has no time to spare (of jumps of
# 0.8 and 0.82 m the others end there as well, after twice the time)
WAYS = ((longer, gripping), (lifted, gripping), (gripping,))


def variants(task: Task) -> Iterator[tuple[str, Task]]:
    """The same motion sought anew."""
    held = task.model_copy(update={"hold": max(task.hold, HOLD)})
    air = task.cost.get("air", 0.0)
    if isinstance(air, float) and air < AIR:
        yield "with less air", held.model_copy(update={"cost": {**task.cost, "air": AIR}})
    for seed in range(1, STARTS + 1):
        guess = {"guess_noise": max(task.guess_noise, NOISE), "seed": task.seed + seed}
        yield "from another start", held.model_copy(update=guess)


def least_grip(model: Model, cases: Sequence[Scenario]) -> float:
    """The share of the friction of `model` that the ground has in all scenarios but those that
    need not succeed; 1 where it varies in none."""
    own = _friction(model)
    there = [f for f in (_friction(case.model) for case in cases) if f is not None]
    if not own or not there:
        return 1.0
    sure = float(np.quantile(there, 1.0 - ENOUGH))
    return min(1.0, sure / own)


def _friction(model: Model) -> float | None:
    ground = next((e for e in model.effects if isinstance(e, Contact)), None)
    return None if ground is None else float(ground.value("mu"))
