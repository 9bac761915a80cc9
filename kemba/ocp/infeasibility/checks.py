"""Before solving: what can be said in milliseconds about a task that cannot be met.

A certain diagnostic refuses the task; the others become hints if solving fails.
"""

from collections.abc import Iterator, Sequence
from itertools import groupby

from kemba.config import Document
from kemba.config.document import Location
from kemba.model import Model
from kemba.ocp.infeasibility.budget import budget_diagnostics
from kemba.ocp.infeasibility.diagnostic import (
    Diagnostic,
    key,
    number,
    one_per_requirement,
    place,
    relax,
    spoken,
)
from kemba.ocp.infeasibility.flight import AskedFlight, flight_of
from kemba.ocp.infeasibility.pose import Gap, Poses
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import Task
from kemba.quantity import Quantity

# s; longest step with which a valve can be timed within a push, which is only a few of these long
LONGEST = 0.05


def check_task(
    task: Task, model: Model, requirements: Sequence[Requirement], document: Document
) -> list[Diagnostic]:
    """Diagnostics, certain ones first; after a certain kind no other kind is looked for."""
    requirements = [r for r in requirements if r.minus is None]
    found = list(contradictions(task, requirements, document))
    if found:
        return found
    poses = Poses(model, requirements)
    found = list(impossible_poses(task, poses, requirements, document))
    if found:
        return found
    flight = flight_of(model, requirements, poses)
    budget = budget_diagnostics(task, model, requirements, flight, document)
    return sorted([*coarse_grid(task, flight, document), *budget], key=lambda f: not f.certain)


def moments(
    task: Task, requirements: Sequence[Requirement]
) -> Iterator[tuple[str, list[Requirement]]]:
    """Every moment by name, with the requirements that hold at it or throughout."""
    always = [w for w in requirements if w.always]
    lasting = [w for w in requirements if w.at is None and not w.always]
    timed = sorted((w for w in requirements if w.at is not None), key=lambda w: w.node(task.nodes))
    for node, group in groupby(timed, key=lambda w: w.node(task.nodes)):
        names = {0: "the start", task.nodes: "the end"}
        here = [w for w in lasting if node in w.nodes(task.nodes)]
        yield names.get(node, f"node {node} of {task.nodes}"), [*group, *here, *always]
    if always and not timed:
        yield "every moment", always


def contradictions(
    task: Task, requirements: Sequence[Requirement], document: Document
) -> Iterator[Diagnostic]:
    """Two requirements on one quantity that exclude each other, or one outside its range."""
    told: set[tuple[Location, Location]] = set()
    for when, here in moments(task, requirements):
        for name in dict.fromkeys(w.quantity.name for w in here):
            same = [w for w in here if w.quantity.name == name]
            low, high = max(same, key=lambda w: w.lower), min(same, key=lambda w: w.upper)
            if low.lower > high.upper + 1e-9 and (low.location, high.location) not in told:
                told.add((low.location, high.location))
                yield _against_requirement(low, high, when, document)
    for requirement in requirements:
        q = requirement.quantity
        if (requirement.lower > q.upper or requirement.upper < q.lower) and (
            requirement.location,
            (),
        ) not in told:
            told.add((requirement.location, ()))
            yield _against_range(requirement, q, document)


def _against_requirement(
    low: Requirement, high: Requirement, when: str, document: Document
) -> Diagnostic:
    unit = low.quantity.unit
    sentence = (
        f"contradiction on {low.quantity.name} at {when}: {spoken(low.location)} "
        f"({place(document, low.location)}) asks for at least {number(low.lower, unit)}, "
        f"{spoken(high.location)} ({place(document, high.location)}) for at most "
        f"{number(high.upper, unit)}"
    )
    weaker = relax(document, low, low.lower, high.upper)
    return Diagnostic(sentence, True, (weaker, relax(document, high, high.upper, low.lower)))


def _against_range(requirement: Requirement, q: Quantity, document: Document) -> Diagnostic:
    above = requirement.lower > q.upper
    asked, end = (requirement.lower, q.upper) if above else (requirement.upper, q.lower)
    given = relax(document, requirement, asked, end)
    sentence = f"{given.placed()}; {q.name} stays within "
    sentence += f"{number(q.lower, q.unit)} to {number(q.upper, q.unit)}"
    return Diagnostic(sentence, True, (given,))


def impossible_poses(
    task: Task, poses: Poses, requirements: Sequence[Requirement], document: Document
) -> Iterator[Diagnostic]:
    """Moments at which no pose and no rates of the robot meet all requirements."""
    for when, here in moments(task, requirements):
        together = poses.gaps(here, here)
        if together == []:
            continue
        single = _smallest(poses, here) or together or []
        given = one_per_requirement(
            relax(document, g.requirement, g.asked, g.reachable) for g in single
        )
        why = "; ".join(r.placed() for r in given) or "the requirements exclude each other"
        reason = "" if together is None else _reason(single, document)
        free = [w for w in here if w.location[0] != "obstacles"]
        if len(free) < len(here) and poses.gaps(free, free) == []:
            why, reason = _in_the_way(here, poses, document), ""
        certain = together is not None
        yield Diagnostic(
            f"no pose of the robot does what {when} asks: {why}{reason}", certain, given
        )


def _smallest(poses: Poses, here: Sequence[Requirement]) -> list[Gap]:
    """The one line of the task that needs the smallest relaxation, relaxed; [] if none helps."""
    best: list[Gap] = []
    for location in dict.fromkeys(w.location for w in here if w.at is not None):
        gaps = poses.gaps(here, [w for w in here if w.location == location])
        if gaps and (not best or _size(gaps) < 0.999 * _size(best)):
            best = gaps
    return best


def _size(gaps: Sequence[Gap]) -> float:
    return sum(abs(g.asked - g.reachable) for g in gaps)


def _in_the_way(here: Sequence[Requirement], poses: Poses, document: Document) -> str:
    """Which obstacle excludes every pose that there is without it."""
    boxes = dict.fromkeys(w.location for w in here if w.location[0] == "obstacles")
    rests = {box: [w for w in here if w.location != box] for box in boxes}
    alone = [box for box, rest in rests.items() if poses.gaps(rest, rest) == []]
    named = [f"{spoken(box)} ({place(document, box)})" for box in alone or boxes]
    return f"{' and '.join(named)} stands in its way"


def _reason(gaps: Sequence[Gap], document: Document) -> str:
    """What prevents it, as far as the requirement shows."""
    feet = [g for g in gaps if g.requirement.quantity.name.endswith(("foot/z", "foot/gap"))]
    sunk = next((g for g in feet if g.asked < g.reachable - 1e-6), None)
    if sunk is not None:
        where = number(sunk.reachable, "m")
        return f"; the ground is at {where}" if sunk.requirement.quantity.name[-1] == "z" else ""
    ground = place(document, ("terrain",)) if "terrain" in (document.data or {}) else ""
    return " with the other requirements kept" + (f", on the ground of {ground}" if ground else "")


def coarse_grid(task: Task, flight: AskedFlight | None, document: Document) -> Iterator[Diagnostic]:
    """Steps too long to time a push."""
    if flight is None or task.step <= LONGEST:
        return
    enough = int(-(-task.duration // LONGEST))
    sentence = (
        f"{key('nodes', document)}: {task.nodes} over {task.duration:g} s make steps of "
        f"{1e3 * task.step:.0f} ms; a push by air needs steps of at most "
        f"{1e3 * LONGEST:.0f} ms, so at least {enough} nodes"
    )
    yield Diagnostic(sentence, True)
