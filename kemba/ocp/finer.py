"""Plans on many nodes: sought on fewer, where it takes seconds, then solved on all of them.

Contacts and valves of a plan are decided on the coarser grid. Its refined plan starts the finer
program near the solution, so that only a few iterations are made on many nodes.
"""

from collections.abc import Callable
from dataclasses import replace
from math import ceil

from kemba.ocp.certificate.status import Status
from kemba.ocp.continuation.origin import Origin
from kemba.ocp.continued import continued
from kemba.ocp.nlp.ending import Ending
from kemba.ocp.planned import Plan
from kemba.ocp.planner import Planner, searched
from kemba.ocp.refined import refined

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
            sought = searched(coarse, False)
            if sought.status is Status.SOLVED and not new(sought):
                return None
            found = _from_fewer(planner, refined(coarse, sought))
            if found is not None:
                return found
    found = searched(planner, refused)
    if found.status is Status.SOLVED and planner.task.refine == "radau":
        return refined(planner, found) if new(found) else None
    return found


def _from_fewer(planner: Planner, found: Plan) -> Plan | None:
    """The plan on the task's nodes from the one `found` on fewer; None where that is not refined or
    cannot be solved on all of them. Where time is up before that, what there is."""
    task = planner.task
    if not found.refined:
        return None if planner.session.control.ended() is None else found
    plain = {"grip": 1.0}  # as the coarser plan was made
    name = f"the plan on {found.task.nodes} nodes"
    origin = Origin(
        found.trajectory, found.model, found.requirements, name, once=True, stages=found.stages
    )
    near, _ = continued(replace(planner, task=task.model_copy(update=plain)), origin)
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
