"""Found plans solved again on their own phases."""

from dataclasses import replace

from kemba.ocp.certificate.objective import costs
from kemba.ocp.certificate.status import Status, missed_of, verdict
from kemba.ocp.nlp.ending import Ending
from kemba.ocp.planned import Plan
from kemba.ocp.planner import Planner
from kemba.ocp.refinement import refine
from kemba.ocp.refinement.refine import Refined
from kemba.ocp.relaxation.session import Attempt


def refined(planner: Planner, found: Plan) -> Plan:
    """The plan on its own phases; where that fails, the same with the reason."""
    session = planner.session
    free = found.task.model_copy(update={"grip": 1.0})  # it comes last, from the plan that is found
    asked = planner.model, free, found.requirements, found.trajectory
    answer = refine(*asked, control=session.control, tell=session.tell)
    session.attempts.append(Attempt("phases", answer.ending, answer.iterations))
    made = _judged(found, answer)
    return made if answer.plain is None else replace(made, plain=_judged(found, answer.plain))


def _judged(found: Plan, answer: Refined) -> Plan:
    new, certificate = answer.trajectory, answer.certificate
    if answer.ending is Ending.INTERRUPTED:
        kept = "interrupted while refining, the implicit Euler plan is kept"
        return replace(found, status=Status.INTERRUPTED, sentence=f"{found.sentence}; {kept}")
    if new is None or certificate is None:
        return _unrefined(found, answer.sentence)
    if certificate.missed:
        return _unrefined(found, missed_of(certificate.missed))
    if not certificate.within(found.task.tolerances):
        return _unrefined(found, "its result misses the task's tolerances")
    status, sentence = verdict(found.task, certificate, new, answer.ending)
    return replace(
        found,
        trajectory=new,
        certificate=certificate,
        status=status,
        sentence=f"{sentence}, in {len(answer.phases)} phases of contacts and valves",
        cost=costs(found.model, new),
        refined=True,
        stages=answer.stages,
    )


def _unrefined(found: Plan, reason: str) -> Plan:
    """A plan that refining was asked for and failed on: it fulfils its own equations, but those of
    implicit Euler, whose chambers and impacts are off; so it is not what was asked."""
    facts = found.sentence.removeprefix(f"{Status.SOLVED}: ")
    kept = f"not refined ({reason}), the implicit Euler plan is kept, whose air forces are inexact"
    hint = "try a larger --time-limit, other starts (--starts 4), or accept it by --set refine=none"
    sentence = f"{Status.ACCEPTABLE}: {facts}; {kept}; {hint}"
    return replace(found, status=Status.ACCEPTABLE, sentence=sentence)
