"""Found plans solved again: on their own phases, for changed figures as of an earlier run's plan,
and on many nodes where few sufficed to find them.

Contacts and valves of a plan are decided on the coarser grid. Its refined plan starts the finer
program near the solution, so that only a few iterations are made on many nodes.
"""

from collections.abc import Callable
from dataclasses import replace
from math import ceil

from kemba.ocp.certificate.certify import costs
from kemba.ocp.certificate.status import Status, missed_of
from kemba.ocp.continuation.continue_plan import Continuation, Continuing
from kemba.ocp.continuation.origin import Origin, completed
from kemba.ocp.nlp.ending import Ending
from kemba.ocp.planned import Plan
from kemba.ocp.planner import Planner, searched
from kemba.ocp.refinement import refine
from kemba.ocp.refinement.refine import Refined
from kemba.ocp.relaxation.session import Attempt
from kemba.ocp.sides import on_level_ground

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
    asked = task, model, planner.requirements
    found = Plan.of(*asked, new, certificate, answer.ending, way.size)
    facts = f"{found.sentence}, {_phases(answer)}, from {origin.name}"
    now, before = found.cost[TORQUE], costs(origin.model, origin.plan)[TORQUE]
    if now > Continuing.dear * before:
        times = f"{now / before:.0f} times the squared torque"
        facts += f"; it takes {times} of {origin.name}, {origin.dear}"
    start = f"run: {origin.run}" if origin.run else "guess"
    known = replace(found, sentence=facts, start=start, stages=answer.stages)
    return replace(known, refined=True, continued=True), ""


def _phases(answer: Refined) -> str:
    return f"in {len(answer.phases)} phases of contacts and valves"


def dear(found: Plan, before: float) -> bool:
    """Whether a plan costs so much more than `before`, by its task's own cost, that one from a
    guess is likely to cost less."""
    return found.objective > Continuing.most(before)


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


def refined(planner: Planner, found: Plan) -> Plan:
    """The plan on its own phases and on the model of the planner; where that fails, the same with
    the reason."""
    session, model, asked = planner.session, planner.model, tuple(planner.requirements)
    free = found.task.model_copy(update={"grip": 1.0})  # it comes last, from the plan that is found
    start = completed(found.trajectory, model)
    answer = refine(model, free, asked, start, control=session.control, tell=session.tell)
    session.attempts.append(Attempt("phases", answer.ending, answer.iterations))
    made = _judged(planner, found, answer)
    plain = answer.plain and _judged(planner, found, answer.plain)
    return replace(made, plain=plain) if plain else made


def _judged(planner: Planner, found: Plan, answer: Refined) -> Plan:
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
    asked, size = (planner.model, planner.requirements), (found.variables, found.constraints)
    made = Plan.of(found.task, *asked, new, certificate, answer.ending, size)
    sentence = f"{made.sentence}, {_phases(answer)}"
    return replace(made, sentence=sentence, refined=True, stages=answer.stages)


def _unrefined(found: Plan, reason: str) -> Plan:
    """A plan that refining was asked for and failed on: it fulfils its own equations, but those of
    implicit Euler, whose chambers and impacts are off; so it is not what was asked."""
    facts = found.sentence.removeprefix(f"{Status.SOLVED}: ")
    kept = f"not refined ({reason}), the implicit Euler plan is kept, whose air forces are inexact"
    hint = "try a larger --time-limit, other starts (--starts 4), or accept it by --set refine=none"
    sentence = f"{Status.ACCEPTABLE}: {facts}; {kept}; {hint}"
    return replace(found, status=Status.ACCEPTABLE, sentence=sentence)


# Nodes at most on which a plan is sought from a guess, by benchmarks/scaling.py --cold --refine
# none: on 200 a forward jump took 2.6 times as long, on 400 one of three ended at the limit.
NODES = 100
STEP = 7e-3  # s; a longer motion is sought on more nodes, of such steps: those of the trials
Judge = Callable[[Plan], bool]


def found_and_refined(planner: Planner, refused: bool, new: Judge) -> Plan | None:
    """A plan from the guess, refined where the task asks for it; without grip, which comes last.
    None where it is not `new`: it is not refined then."""
    if planner.task.refine == "radau" and planner.start is None and not refused:
        fewer = max(NODES, ceil(planner.task.duration / STEP))
        if planner.task.nodes > fewer:
            coarse = replace(planner, task=planner.task.model_copy(update={"nodes": fewer}))
            sought = _sought(coarse, False)
            if sought.status is Status.SOLVED and not new(sought):
                return None
            found = _from_fewer(planner, refined(coarse, sought))
            if found is not None:
                return found
    found = _sought(planner, refused)
    if found.status is Status.SOLVED and planner.task.refine == "radau":
        return refined(planner, found) if new(found) else None
    return found


def _sought(planner: Planner, refused: bool) -> Plan:
    """A plan from the guess, on the model on which plans are sought, on level ground where it is
    asked for."""
    seeker = planner.seeking
    if planner.level:
        seeker = on_level_ground(seeker) or seeker
    found = searched(seeker, refused)
    planner.outcome = seeker.outcome
    return found


def _from_fewer(planner: Planner, found: Plan) -> Plan | None:
    """The plan on the task's nodes from the one `found` on fewer; None where that is not refined or
    cannot be solved on all of them. Where time is up before that, what there is."""
    task = planner.task
    if not found.refined:
        return None if planner.session.control.ended() is None else found
    plain = {"grip": 1.0}  # as the coarser plan was made
    name = f"the plan on {found.task.nodes} nodes"
    finer = replace(planner, task=task.model_copy(update=plain))
    near, _ = continued(finer, found.origin(name, once=True))
    if near is not None:
        return replace(near, task=task, continued=None)
    ended = planner.session.control.ended()
    return None if ended is None else _kept(found, task.nodes, ended)


def _kept(found: Plan, nodes: int, ended: Ending) -> Plan:
    """A plan on fewer nodes than were asked for, because there was no time for more."""
    interrupted = ended is Ending.INTERRUPTED
    why = "interrupted" if interrupted else "the time limit came"
    what = f"{why} before it was solved on {nodes} nodes, {found.task.nodes} are kept"
    status = Status.INTERRUPTED if interrupted else Status.ACCEPTABLE
    return replace(found, status=status, sentence=f"{found.sentence}; {what}")
