"""Plans from an earlier run's plan, judged; and what is said where that fails."""

from dataclasses import replace

from kemba.ocp.certificate.objective import costs, objective
from kemba.ocp.certificate.status import Status, missed_of, verdict
from kemba.ocp.continuation.continue_plan import Continuation, Continuing
from kemba.ocp.continuation.origin import Origin
from kemba.ocp.nlp.ending import Ending
from kemba.ocp.planned import Plan
from kemba.ocp.planner import Planner

TORQUE = "torque_squared_integral"


def continued(planner: Planner, origin: Origin) -> tuple[Plan | None, str]:
    """The earlier plan for the changed figures; None and the reason where that fails.

    A task with `refine: none` asks for an implicit Euler plan, which this way cannot give.
    """
    session, task, model = planner.session, planner.task, planner.model
    if task.refine != "radau":
        return None, "it gives refined plans, and this task asks for refine: none"
    way = Continuation(model, task, planner.requirements, origin, session.control, session.tell)
    answer = way.run()
    session.attempts += way.steps
    new, certificate = answer.trajectory, answer.certificate
    if answer.ending is Ending.INTERRUPTED or new is None or certificate is None:
        return None, answer.sentence
    if certificate.missed:
        return None, f"its result is not what was asked: {missed_of(certificate.missed)}"
    if not certificate.within(task.tolerances):
        return None, "its result misses the task's tolerances"
    status, sentence = verdict(task, certificate, new, answer.ending)
    facts = f"{sentence}, in {len(answer.phases)} phases of contacts and valves, from {origin.name}"
    cost, before = costs(model, new), costs(origin.model, origin.plan)
    if cost[TORQUE] > Continuing.dear * before[TORQUE]:
        times = f"{cost[TORQUE] / before[TORQUE]:.0f} times the squared torque"
        facts += f"; it takes {times} of {origin.name}, {origin.dear}"
    found = Plan(
        task=task,
        model=model,
        requirements=tuple(planner.requirements),
        trajectory=new,
        certificate=certificate,
        status=status,
        sentence=facts,
        cost=cost,
        variables=way.size[0],
        constraints=way.size[1],
        refined=True,
        continued=True,
        start=f"run: {origin.run}" if origin.run else "guess",
        stages=answer.stages,
    )
    return found, ""


def dear(found: Plan, before: float) -> bool:
    """Whether a plan costs so much more than `before`, by its task's own cost, that one from a
    guess is likely to cost less."""
    own = objective(found.model, found.task, found.requirements, found.trajectory)
    return own > Continuing.most(before)


def from_scratch(found: Plan, why: str) -> Plan:
    """A plan that was made anew because continuing the earlier one failed; its sentence says so."""
    said = f"{found.sentence}; made from scratch, because the earlier plan could not be continued"
    sentence = found.sentence if found.status is Status.INTERRUPTED else f"{said} ({why})"
    return replace(found, sentence=sentence, continued=False)


def with_grip(planner: Planner, found: Plan) -> Plan:
    """The plan solved again within `grip`.

    Which way a foot pushes is decided in the relaxed problem on all of the ground's friction, so
    this comes last. Where it fails, the plan without it is not what was asked.
    """
    known = found.trajectory, planner.model, tuple(planner.requirements)
    origin = Origin(*known, "the plan without `grip`", stages=found.stages)
    near, why = continued(planner, origin)
    if near is None:
        what = f"`grip` is not kept ({why})"
        return replace(found, status=Status.ACCEPTABLE, sentence=f"{what}; {found.sentence}")
    return replace(near, continued=None)
