"""A plan executed on its own model and on the plant, against what its task allows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from kemba.model import Model
from kemba.ocp import Plan, Task, controller_table
from kemba.ocp.certificate.asked import MeasuredRequirement, on_execution
from kemba.plant.certificate import executions, plant_run, summaries
from kemba.plant.repeat import counterpart
from kemba.plant.replay import Replay
from kemba.plant.strides import Stability, stability
from kemba.solve.truth import PLANT, ApexBand, Truth, band_of, beyond, truth_of
from kemba.solve.verdict import EXECUTIONS, Allowed, Verdict, allowances, judge
from kemba.stopwatch import Tell, silent
from kemba.trajectory import Array, Trajectory

STRIDES = 5  # of a periodic motion, played in a row
OWN = ("replay", "table_replay")  # the executions on the plan's own model


@dataclass(frozen=True)
class Feedback:
    """A policy by which the plant keeps to a plan: its arrays, the verdict on its worst execution,
    and the entry `feedback` of the certificate."""

    arrays: Mapping[str, Array]
    verdict: Verdict
    json: Mapping[str, Any]


@dataclass(frozen=True)
class Judged:
    """The entries of a plan's executions in the certificate, the verdict on each, and the motion of
    the plant if it could be started. `truth`: whose verdict counts; `band`: of the apex on models
    within the uncertainty of a learnt one; `stability`: of a periodic motion; `feedback`: by which
    the plant keeps to the plan."""

    facts: Mapping[str, Any]
    verdicts: Mapping[str, Verdict]
    motion: Trajectory | None
    truth: Truth = field(default_factory=lambda: Truth(PLANT))
    band: ApexBand | None = None
    stability: Stability | None = None
    feedback: Feedback | None = None

    @property
    def deciding(self) -> Mapping[str, Verdict]:
        """The verdicts that decide: a model that was learnt from logs outranks the plant, which
        feedback may lead where the table alone does not."""
        found = {k: v for k, v in self.verdicts.items() if k in OWN or not self.truth.learnt}
        return {**found, "plant_replay": self.feedback.verdict} if self.feedback else found

    @property
    def causes(self) -> list[str]:
        """Why the plan is not confirmed; empty where it is."""
        found = [verdict.sentence for verdict in self.deciding.values() if not verdict.good]
        unsure = self.band is not None and not self.band.good
        return [*found, *([self.band.sentence] if self.band and unsure else [])]

    @property
    def good(self) -> bool:
        """Whether every execution that decides keeps to the tolerances."""
        return not self.causes

    @property
    def remarks(self) -> list[str]:
        """What else is to be said of the executions and of what they rest on."""
        found = [v.sentence for v in self.deciding.values() if v.good]
        if self.truth.learnt:
            found.append(f"on the simulated robot with physical chambers: {self._plant}")
        if self.band is not None and self.band.good:
            found.append(self.band.sentence)
        if self.stability is not None:
            found.append(self.stability.sentence)
        return [*found, *self.truth.remarks]

    @property
    def _plant(self) -> str:
        there = self.verdicts["plant_replay"]
        said = there.sentence.removeprefix("the ").removeprefix("simulated robot ")
        return said if there.good else f"it {said}, which is information only"

    @property
    def share(self) -> float:
        """The largest error of the executions that decide, in units of what is allowed; infinite
        after a fall."""
        return max(verdict.share for verdict in self.deciding.values())

    @property
    def replays(self) -> bool:
        """Whether the executions on the plan's own model do."""
        return all(self.verdicts[name].good for name in OWN)


def plant_of(task: Task) -> Model:
    """The plant of a task: on its own robot, supply, payload and effects. Raises KembaError."""
    return counterpart(
        task.model, task.payload, task.supply, task.plant, changes=task.effects, scene=task.scene
    )


def judged(
    found: Plan, table: Trajectory, plant: Model | None = None, tell: Tell = silent
) -> Judged:
    """Execute a plan and its table, on its model and on the plant, and judge them by its task.

    `plant`: that of the task when None. Raises KembaError where the plant cannot be built.
    """
    model, plan, task = found.model, found.trajectory, found.task
    machine = plant or plant_of(task)
    done = executions(model, plan, table, machine, tell)
    facts = summaries(model, done)
    stable: Stability | None = None
    if task.periodic is not None:
        tell("replay: strides in a row")

        def play(motion: Trajectory) -> dict[str, Replay | None]:
            return executions(model, motion, controller_table(model, motion, task.hold), machine)

        stable = stability(model, plan, STRIDES, play)
        facts |= {"strides": stable.json()}
    limits = allowances(task.tolerances, landing_speed(plan))
    verdicts = {}
    for key, who in EXECUTIONS.items():
        # a plant may miss by more than most bounds leave: it is judged by where it goes alone
        asked = asked_of(found, done[key], limits[key]) if key in OWN else ()
        verdicts[key] = judge(who, done[key], limits[key], asked, same_model=key in OWN)
    there, truth = done["plant_replay"], truth_of(task)
    band: ApexBand | None = None
    if truth.learnt and truth.evidence is not None:
        band, why = band_of(found, table)
        said = [*truth.remarks, *beyond(found, truth.evidence), why]
        truth = replace(truth, remarks=tuple(text for text in said if text))
    return Judged(facts, verdicts, plant_run(there) if there else None, truth, band, stable)


def asked_of(found: Plan, done: Replay | None, allowed: Allowed) -> Sequence[MeasuredRequirement]:
    """What the task asks of lengths and angles, measured on an execution."""
    if done is None:
        return ()
    may = allowed.apex, allowed.final, allowed.touchdown
    return on_execution(found.requirements, found.trajectory, done.trajectory, *may)


def landing_speed(plan: Trajectory) -> float:
    """How fast [m/s] the body of a plan falls at most after its apex."""
    return max(0.0, -float(plan["body/vz"][int(np.argmax(plan["body/z"])) :].min()))
