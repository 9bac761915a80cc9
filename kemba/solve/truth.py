"""Whose verdict counts: the learnt model's where logs speak for it, else the simulated robot's."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from kemba.errors import KembaError, enumerated
from kemba.events import peak
from kemba.files import sha256
from kemba.mechanism.robot_file import robot_files
from kemba.model import Evidence, Model, load_spec
from kemba.model.spec import DRAWN, drawn_models, evidence_folder
from kemba.ocp import Plan, Task
from kemba.plant.certificate import rest_after
from kemba.plant.controller import Execution, execute_many
from kemba.trajectory import Trajectory

LEARNT, PLANT = "learnt model", "plant"
LANDS = 0.95  # share of the drawn models on which a landing must be kept


@dataclass(frozen=True)
class ApexBand:
    """What a controller's table does on models drawn from the covariance of what was learnt: how
    many were executed, on how many the motion is kept, and the 95 % band of the apex [m]."""

    n: int
    landed: int
    low: float
    high: float

    @property
    def good(self) -> bool:
        """Whether the motion is kept on nearly all of them."""
        return self.landed >= LANDS * self.n

    @property
    def sentence(self) -> str:
        """The band in words."""
        kept = f"{self.landed} of {self.n} models within its uncertainty keep the motion"
        return f"expected apex {self.low:.3f} to {self.high:.3f} m (95 %), {kept}"

    def json(self) -> dict[str, Any]:
        """The entry `band` of the certificate."""
        return {
            "n": self.n, "landed": self.landed, "apex_low_m": self.low, "apex_high_m": self.high,
        }  # fmt: skip


@dataclass(frozen=True)
class Truth:
    """On which model's executions a plan is judged, and what is to be said of its evidence."""

    on: str
    remarks: tuple[str, ...] = ()
    evidence: Evidence | None = None

    @property
    def learnt(self) -> bool:
        """Whether the plan's own model, learnt from logs, decides."""
        return self.on == LEARNT


def truth_of(task: Task) -> Truth:
    """Whose verdict counts for the plans of a task. Raises KembaError where the model is gone.

    A model with evidence decides, unless the task changes what was learnt, or the simulated robot
    is known to explain the logs better.
    """
    spec = load_spec(task.model)
    evidence = spec.evidence
    if evidence is None:
        return Truth(PLANT)
    remarks = evidence.faults(evidence_folder(task.model))
    robot = evidence.measured.robot
    if robot and spec.robot and robot != sha256(robot_files(spec.robot)[0]):
        said = "the robot's file has changed since the logs were taken: they do not speak for it"
        return Truth(PLANT, (*remarks, said))
    learnt = {e.name for e in spec.effects if e.support is not None}
    learnt |= {figure.rsplit(".", 1)[0] for figure in evidence.figures}
    given = task.effects.keys() | ({"payload"} if task.payload else set())
    if given & learnt:
        names = _listed(given & learnt)
        said = f"the task changes {names}, which was learnt: the logs do not speak for this model"
        return Truth(PLANT, (*remarks, said))
    if task.effects:
        remarks.append(f"beyond what was measured: no log was taken with {_listed(task.effects)}")
    own, plant = evidence.error_held_out, evidence.error_plant
    if own is not None and plant is not None and plant <= own:
        said = f"the simulated robot explains the logs better ({plant:.2f} times the noise) than "
        said += f"the learnt model ({own:.2f}), so its verdict decides"
        return Truth(PLANT, (*remarks, said), evidence)
    return Truth(LEARNT, tuple(remarks), evidence)


def _listed(effects: Iterable[str]) -> str:
    return enumerated([f"`effects.{name}`" for name in sorted(effects)])


def beyond(found: Plan, evidence: Evidence) -> list[str]:
    """What of a plan lies outside of what the logs of its model have, a sentence each."""
    plan, legs = found.trajectory, found.model.mechanism.legs
    apex, speed = plan["body/z"].max(), np.hypot(plan["body/vx"], plan["body/vz"]).max()
    pairs = [(plan[f"{leg}/valve/extend"], plan[f"{leg}/valve/retract"]) for leg in legs]
    modes = {f"{e:.0f}{r:.0f}" for pair in pairs for e, r in zip(*pair, strict=True)}
    sentences = evidence.beyond(float(apex), float(speed), found.model.supply, modes)
    load, known = found.task.payload, evidence.measured.payload or 0.0
    if abs(load - known) > 1e-9:
        other = f"payload {load:g} kg, the logs were taken with {known:g} kg"
        sentences.append(f"beyond what was measured: {other}")
    return sentences


def on_drawn_models(
    model: Model, name: str, table: Trajectory, rest: float
) -> list[tuple[Model, Execution]]:
    """A controller's table executed on `DRAWN` models from the covariance of the model YAML `name`
    about `model`, and `rest` [s] longer; without those that cannot be simulated.

    Raises KembaError where there is no covariance.
    """
    drawn = drawn_models(model, name)
    done = execute_many(table, [{"model": each, "extra": rest} for each in drawn])
    return [(m, d) for m, d in zip(drawn, done, strict=True) if not isinstance(d, KembaError)]


def band_of(found: Plan, table: Trajectory) -> tuple[ApexBand | None, str]:
    """The band of a plan's table on models drawn from the covariance of its own; None and why where
    there is no covariance."""
    model, plan = found.model, found.trajectory
    try:
        done = on_drawn_models(model, found.task.model, table, rest_after(model, plan, table))
    except KembaError as error:
        return None, f"how sure the plan is cannot be said: {error.what}"
    if len(done) < 2:
        return None, "how sure the plan is cannot be said: no drawn model can be simulated"
    motions = [run.trajectory for _, run in done]
    apex = [peak(motion.time, motion["body/z"])[1] for motion in motions]
    kept = sum(run.against(each, plan).landed for each, run in done)
    middle = peak(plan.time, plan["body/z"])[1]
    reach = 1.96 * float(np.std(apex, ddof=1))
    return ApexBand(DRAWN, kept, middle - reach, middle + reach), ""
