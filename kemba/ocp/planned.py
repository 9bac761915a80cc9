"""A plan and how good it really is: its certificate, status and sentence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from kemba.model import Model
from kemba.ocp.certificate.certify import Certificate, certify
from kemba.ocp.certificate.grazing import grazes
from kemba.ocp.certificate.objective import costs
from kemba.ocp.certificate.status import Status, verdict
from kemba.ocp.infeasibility.diagnostic import Relax
from kemba.ocp.infeasibility.explain import Explanation
from kemba.ocp.nlp.ipopt import Iterate
from kemba.ocp.phases.stages import Stages
from kemba.ocp.relaxation.session import Attempt
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import Task
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

    @property
    def iterations(self) -> int:
        """IPOPT iterations over all solves."""
        return sum(a.iterations for a in self.attempts)


def judge(
    requirements: Sequence[Requirement], transcription: Transcription, point: Iterate
) -> Plan:
    """Certificate, status and sentence of what was found; `requirements` are all of the task's."""
    task, model = transcription.task, transcription.model
    trajectory = to_trajectory(transcription, point.Y)
    # `grip` comes last, on the refined plan
    certificate = certify(model, task.model_copy(update={"grip": 1.0}), requirements, trajectory)
    status, sentence = verdict(task, certificate, trajectory, point.ending)
    return Plan(
        task=task,
        model=model,
        requirements=tuple(requirements),
        trajectory=trajectory,
        certificate=certificate,
        status=status,
        sentence=sentence,
        cost=costs(model, trajectory),
        variables=transcription.variables,
        constraints=transcription.constraints,
    )


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
    what = f"`clearance` is not kept: {touches[0].sentence}"
    return replace(found, status=Status.ACCEPTABLE, sentence=f"{what}; {found.sentence}")
