"""A plan executed on its own model and on the plant, against what its task allows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from kemba.model import Model
from kemba.ocp import Plan, Task, controller_table
from kemba.plant.execution.certificate import executions, plant_run, summaries
from kemba.plant.execution.counterpart import counterpart
from kemba.plant.execution.replay import Replay, ends_standing
from kemba.plant.execution.retiming import ExecutedTable, retimed
from kemba.report.judging.verdict import Verdict, verdicts
from kemba.stopwatch import Tell, silent
from kemba.trajectory import Trajectory


@dataclass(frozen=True)
class Judged:
    """The entries of a plan's executions in the certificate, the verdict on each, and the motion of
    the plant if it could be started."""

    facts: Mapping[str, Any]
    verdicts: Mapping[str, Verdict]
    motion: Trajectory | None

    @property
    def good(self) -> bool:
        """Whether every execution keeps to the tolerances."""
        return all(verdict.good for verdict in self.verdicts.values())

    @property
    def share(self) -> float:
        """The largest error of all executions in units of what is allowed; infinite after a
        fall."""
        return max(verdict.share for verdict in self.verdicts.values())

    @property
    def replays(self) -> bool:
        """Whether the executions on the plan's own model do."""
        return all(self.verdicts[name].good for name in ("replay", "table_replay"))


def plant_of(task: Task) -> Model:
    """The plant of a task: on its own robot, supply, payload and effects. Raises KembaError."""
    return counterpart(task.model, task.payload, task.supply, task.plant, changes=task.effects)


def table_of(found: Plan) -> ExecutedTable:
    """The controller's table of a plan, its valve edges moved by ticks where that helps."""
    table = controller_table(found.model, found.trajectory, found.task.hold)
    return retimed(found.model, found.trajectory, table)


def judged(
    found: Plan,
    table: Trajectory,
    plant: Model | None = None,
    tell: Tell = silent,
    known: Replay | None = None,
) -> Judged:
    """Execute a plan and its table, on its model and on the plant, and judge them by its task.

    `plant`: that of the task when None. `known`: the table's execution on the plan's model, where
    there was one. Raises KembaError where the plant cannot be built.
    """
    model, plan, task = found.model, found.trajectory, found.task
    done = executions(model, plan, table, plant or plant_of(task), tell, known)
    facts = summaries(model, done)
    there = done["plant_replay"]
    lands = bool(ends_standing(model, plan))
    judgements = verdicts(facts, task.tolerances, lands)
    return Judged(facts, judgements, plant_run(there) if there else None)
