"""A plan and how good it really is: its certificate, status and sentence, its answer in JSON."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from kemba.errors import enumerated
from kemba.events import LASTS, PLANNED, feet, read
from kemba.model import Model
from kemba.ocp.certificate.certify import Certificate, certify, costs, gains, objective
from kemba.ocp.certificate.status import Status, verdict
from kemba.ocp.continuation.origin import Origin
from kemba.ocp.infeasibility.explain import Explanation, Relax
from kemba.ocp.nlp.ending import Ending
from kemba.ocp.nlp.ipopt import Iterate
from kemba.ocp.phases.stages import Stages
from kemba.ocp.relaxation.session import Attempt
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import Task
from kemba.ocp.task.templates import rise_of_feet
from kemba.ocp.transcription.solution import to_trajectory
from kemba.ocp.transcription.transcribe import Transcription
from kemba.trajectory import Trajectory


@dataclass(frozen=True)
class Plan:
    """What solving gave: the trajectory, how good it really is, and what it took."""

    task: Task
    model: Model
    requirements: tuple[Requirement, ...]
    trajectory: Trajectory
    certificate: Certificate
    status: Status
    sentence: str
    cost: dict[str, float]
    variables: int
    constraints: int
    attempts: tuple[Attempt, ...] = ()  # of all solves up to this plan, as the times
    solve_s: float = 0.0
    solve_cpu_s: float = 0.0
    build_s: float = 0.0
    relax: tuple[Relax, ...] = ()
    refined: bool = False
    continued: bool | None = None  # whether it comes from an earlier plan, where one was given
    start: str = "guess"  # or the run from which it begins
    stages: Stages | None = field(default=None, repr=False, compare=False)  # of a refined plan
    # the same before pulses of valves were put in
    plain: Plan | None = field(default=None, repr=False, compare=False)

    @classmethod
    def of(
        cls,
        task: Task,
        model: Model,
        requirements: Sequence[Requirement],
        trajectory: Trajectory,
        certificate: Certificate,
        ending: Ending | None,
        size: tuple[int, int],
    ) -> Plan:
        """A trajectory with its certificate; `ending` is that of its last solve, `size` how many
        variables and rows it had."""
        status, sentence = verdict(task, certificate, trajectory, ending)
        facts = certificate, status, sentence, costs(model, trajectory)
        return cls(task, model, tuple(requirements), trajectory, *facts, *size)

    @property
    def iterations(self) -> int:
        """IPOPT iterations over all solves."""
        return sum(a.iterations for a in self.attempts)

    def origin(self, name: str, **how: Any) -> Origin:
        """It as the origin of another plan; `how`: further fields of `Origin`."""
        known = self.trajectory, self.model, self.requirements
        return Origin(*known, name, stages=self.stages, **how)

    @property
    def objective(self) -> float:
        """What its task minimises: weighted costs, less what is gained by quantities it aims at."""
        return objective(self.model, self.task, self.requirements, self.trajectory)


def judge(
    model: Model, requirements: Sequence[Requirement], transcription: Transcription, point: Iterate
) -> Plan:
    """Certificate, status and sentence of what was found; `requirements` are all of the task's on
    its `model`, of which the program may have another scene."""
    task, other = transcription.task, model is not transcription.model
    trajectory = to_trajectory(transcription, point.Y, model if other else None)
    # `grip` comes last, on the refined plan
    certificate = certify(model, task.model_copy(update={"grip": 1.0}), requirements, trajectory)
    size = transcription.variables, transcription.constraints
    return Plan.of(task, model, requirements, trajectory, certificate, point.ending, size)


def explained(found: Plan, why: Explanation) -> Plan:
    """The same with the reason: what is proven replaces the solver's status and words."""
    if not why.proven:
        return replace(found, sentence=f"{found.sentence}; {why.sentence}")
    return replace(found, status=Status.INFEASIBLE, sentence=why.sentence, relax=why.relax)


def clear(found: Plan) -> Plan:
    """The same; not what was asked where a foot grazes the ground in flight."""
    touches = grazes(found.trajectory, euler=not found.refined)
    if not touches:
        return found
    what = not_clear(found.task, touches[0])
    return replace(found, status=Status.ACCEPTABLE, sentence=f"{what}; {found.sentence}")


def not_clear(task: Task, graze: Graze) -> str:
    """That a foot touches the ground where the task asks it to be clear of it, in words."""
    line = f" ({place})" if (place := task.place("clearance")) else ""
    return f"`clearance`{line}: {task.clearance:g} m is asked, but {graze.sentence}"


@dataclass(frozen=True)
class Graze:
    """A foot that touches at a time [s] for a `duration` [s] and leaves again."""

    foot: str
    time: float
    duration: float

    @property
    def sentence(self) -> str:
        """What happens, in words."""
        lasts = f"{1e3 * self.duration:.0f} ms"
        return f"{self.foot} touches the ground for {lasts} at {self.time:.3f} s and leaves again"


def grazes(plan: Trajectory, euler: bool = False) -> list[Graze]:
    """The short contacts of a plan's feet between two times in the air.

    `euler`: the plan is an implicit Euler one, whose ground pushes in the whole step before the
    first row at which a foot is down.
    """
    found = []
    for leg, spans in read(plan, PLANNED).contacts.items():
        for span in (s for s in spans if not s.firm):
            row = int(np.searchsorted(plan.time, span.begin))
            begin = float(plan.time[row - 1]) if euler else span.begin
            if span.end - begin < LASTS:
                found.append(Graze(f"{leg}/foot", begin, span.end - begin))
    return found


GROUND = 1e-3  # m; lower feet stand


def sentence_of(plan: Plan) -> str:
    """The plan's sentence for the user; that of a plan which is not what was asked says so."""
    asked = plan.status in (Status.SOLVED, Status.INTERRUPTED)
    return plan.sentence if asked else f"FAILED: {plan.sentence}"


def warnings(plan: Plan) -> list[str]:
    """What a task that was met may not have meant; of several goals that are to be large or small,
    what each weighs beside the others."""
    traded = gains(plan.requirements, plan.trajectory)
    weighs = enumerated([f"{name} by {gain:.3g}" for name, gain in traded.items()])
    found = [f"goals lower the cost [N2.m2.s]: {weighs}"] if len(traded) > 1 else []
    rests = any(r.location == ("end", "rest") for r in plan.requirements)
    heights = [gap[-1] for gap in feet(plan.trajectory).values()]
    if not rests or not heights or min(heights) <= GROUND:
        return found
    hint = 'a robot in the air falls; ask for `"*/foot/gap": 0 m` at the end'
    return [*found, f"the motion ends at rest with no foot on the ground: {hint}"]


TAKEN = ("solve_s", "solve_cpu_s", "build_s", "iterations", "variables", "constraints")
RESIDUALS = ("complementarity", "binary", "dynamics", "bounds")
RELAXED = ("requirement", "where", "asked", "reachable", "unit")


def answer(plan: Plan, run: str) -> dict[str, Any]:
    """The JSON of `solve`, also written as certificate.json."""
    trajectory, certificate = plan.trajectory, plan.certificate
    tolerances = plan.task.tolerances
    limit = max(tolerances.complementarity, tolerances.dynamics, tolerances.bounds)
    return {
        "status": plan.status,
        "sentence": sentence_of(plan),
        "run": run,
        "task": plan.task.name,
        "apex_m": float(max(trajectory["body/z"])),
        "feet_m": rise_of_feet(trajectory),
        "duration_s": float(trajectory.time[-1]),
        "cost": plan.cost,
        **{name: getattr(plan, name) for name in TAKEN},
        "residuals": {name: getattr(certificate, name) for name in RESIDUALS},
        **dict.fromkeys(("replay", "table_replay", "plant_replay", "impacts")),  # once executed
        "requirements": [measured.json() for measured in certificate.asked],
        "reached": {
            measured.goal: measured.value for measured in certificate.asked if measured.goal
        },
        **dict.fromkeys(("verdict_on", "band", "robust", "strides")),  # the same
        "good": plan.status is Status.SOLVED,
        "continued": plan.continued,
        "start": plan.start,
        "best_known": None,
        "ignored": plan.model.ignored,
        "remarks": [*plan.model.remarks, *warnings(plan)],
        "relax": [{name: getattr(r, name) for name in RELAXED} for r in plan.relax],
        "worst": [
            {key: value for key, value in asdict(v).items() if key != "size"}
            for v in certificate.worst
            if v.size > limit
        ],
        "attempts": [asdict(a) for a in plan.attempts],
    }
