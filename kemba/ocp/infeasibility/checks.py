"""Before solving: what can be said in milliseconds about a task that cannot be met: contradictions,
impossible poses, and energy, time and friction against what the robot can give.

A certain diagnostic refuses the task; the others become hints if solving fails.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from kemba.config import Document
from kemba.config.document import Location
from kemba.model import Model
from kemba.model.rest import at_rest
from kemba.ocp.infeasibility.explain import (
    Diagnostic,
    key,
    number,
    one_per_requirement,
    place,
    relax,
    spoken,
)
from kemba.ocp.infeasibility.pose import Gap, Poses
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import Task
from kemba.ocp.task.terrain import ground_at, stands
from kemba.quantity import Quantity


@dataclass(frozen=True)
class AskedFlight:
    """A height that asks for a flight, and what is known about it before solving.

    z0, z1 [m]: heights of the body at the start, and at the landing if there is one; mass [kg],
    fall [m.s-2] with boom and payload; swing [m]: how far moving legs shift the body against the
    centre of mass at most; `stays_below`: the height is the highest point.
    """

    requirement: Requirement
    height: float
    z0: float
    z1: float | None
    mass: float
    fall: float
    swing: float
    stays_below: bool

    def least_time(self, other: float, generous: bool) -> float:
        """Seconds between the apex and the height `other` [m], at least.

        The ground only pushes: the centre of mass accelerates downwards by `fall` at most.
        `generous`: the motion of the legs may add their swing to the body's height.
        """
        lent = self.swing if generous else 0.0
        way = max(self.height - other - lent, 0.0)
        return float(np.sqrt(2 * way / self.fall) - np.sqrt(2 * lent / self.fall))

    def most(self, other: float, span: float) -> float:
        """The greatest height [m] that `span` seconds from or to the height `other` allow."""
        lent = float(np.sqrt(2 * self.swing / self.fall))
        return other + self.swing + self.fall * (span + lent) ** 2 / 2


def flight_of(
    model: Model, requirements: Sequence[Requirement], poses: Poses
) -> AskedFlight | None:
    """The flight to the greatest height that is required of the body, from a start at rest."""
    highest = [
        w for w in requirements if w.quantity.name == "body/z" and w.at and np.isfinite(w.lower)
    ]
    start = [w for w in requirements if w.at == 0.0]
    resting = any(w.location[-1] == "rest" for w in start)
    grounded = any(stands(model, w) for w in start)
    if not highest or not resting or not grounded:
        return None
    requirement = max(highest, key=lambda w: w.lower)
    robot = model.mechanism.need_robot()
    leg = robot.leg.femur.length + robot.leg.tibia.length
    first, last = (ground_at(model, requirements, at) for at in (0.0, 1.0))
    if requirement.lower <= max(first, last) + leg:
        return None
    mass, weight = inertia_and_weight(model)
    end = [w for w in requirements if w.at == 1.0]
    lands = any(stands(model, w) for w in end)
    below = [w for w in requirements if w.quantity.name == "body/z" and w.always]
    return AskedFlight(
        requirement,
        requirement.lower,
        poses.highest(start) or leg + first,
        (poses.highest(end) or leg + last) if lands else None,
        mass,
        weight / mass,
        leg_swing(model) / mass,
        any(w.upper <= requirement.lower for w in below),
    )


def leg_swing(model: Model) -> float:
    """How far moving legs can shift the centre of mass at most, times the mass [kg.m]."""
    robot = model.mechanism.need_robot()
    leg = robot.leg
    shank = leg.femur.length + leg.tibia.com
    rod = leg.piston.mount + leg.piston.retracted + robot.stroke
    arms = leg.femur.mass * leg.femur.com + leg.tibia.mass * shank
    arms += leg.cylinder.mass * (leg.piston.mount + leg.cylinder.com) + leg.rod.mass * rod
    return 2 * len(robot.legs) * arms


def inertia_and_weight(model: Model) -> tuple[float, float]:
    """What the body's height feels in free fall: mass [kg] and weight [N], all effects counted."""
    node = model.node
    row = [c.name for c in model.mechanism.coordinates].index("body/z")
    q = np.array([model.mechanism.standing[c.name] for c in model.mechanism.coordinates])
    still, s = np.zeros(len(q)), np.array([x.value for x in model.states.values()])
    sd, lam, u, p = (np.zeros(x.numel()) for x in (node.sd, node.lam, node.u, node.p))

    def force(a: float) -> float:
        up = a * (np.arange(len(q)) == row)
        found = node.residual(q, still, up, s, sd, lam, u, p)
        return float(found[0][row])

    return abs(force(1.0) - force(0.0)), abs(force(0.0))


def air_work(model: Model) -> float:
    """Energy [J] that all pistons give over one stroke, at their steady force from the supply."""
    node, stroke = model.node, model.mechanism.stroke
    q = np.array([model.mechanism.standing[c.name] for c in model.mechanism.coordinates])
    v, lam = np.zeros(len(q)), np.zeros(node.lam.numel())
    u = np.array([float(symbol == "u_e") for _, symbol in model.inputs])
    s = at_rest(model, q, u)
    p = np.zeros(node.p.numel())
    measured = np.array(node.measure(q, v, v, s, 0 * s, lam, u, p)).ravel()
    each = zip(node.output_quantities, measured, strict=True)
    forces = (max(value, 0.0) for quantity, value in each if quantity.name.endswith("piston/F"))
    return float(sum(forces) * stroke)


def hip_power(model: Model) -> float:
    """Mechanical power [W] of all hips at most: peak torque at no-load speed, generously."""
    hips = [e for e in model.effects if e.kind == "motor"]
    legs = len(model.mechanism.legs)
    return sum(float(e.value("tau_peak") * e.value("w_noload")) * legs for e in hips)


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
    if flight is not None:
        found += [*coarse_grid(task, document), *_time(task, flight, document)]
        found += _energy(task, model, flight, document)
    return sorted([*found, *_grip(model, requirements, document)], key=lambda f: not f.certain)


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
        q, pair = requirement.quantity, (requirement.location, ())
        outside = requirement.lower > q.upper or requirement.upper < q.lower
        if outside and pair not in told:
            told.add(pair)
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


def coarse_grid(task: Task, document: Document) -> Iterator[Diagnostic]:
    """Steps too long to time the push of a flight."""
    if task.step <= LONGEST:
        return
    enough = int(-(-task.duration // LONGEST))
    sentence = (
        f"{key('nodes', document)}: {task.nodes} over {task.duration:g} s make steps of "
        f"{1e3 * task.step:.0f} ms; a push by air needs steps of at most "
        f"{1e3 * LONGEST:.0f} ms, so at least {enough} nodes"
    )
    yield Diagnostic(sentence, True)


HEAVY = 0.2  # payload of all that is lifted, from which it is named as a cause
FORWARD = 0.01  # m, way forward that needs friction of the ground: less is within the legs' swing


STROKES = 3  # pushes in one motion, as none has more; a task that needs more energy is refused


def _time(task: Task, flight: AskedFlight, document: Document) -> Iterator[Diagnostic]:
    """Rise to the apex and fall from it within the longest steps allowed."""
    longest = task.duration * (1 + task.step_variation)
    before = longest * (flight.requirement.at or 0.0)
    spans = []
    if flight.stays_below and before < longest:
        spans.append(("rise", flight.z0, before))
        if flight.z1 is not None:
            spans.append(("fall", flight.z1, longest - before))
    for what, other, span in spans:
        needed = flight.least_time(other, generous=False)
        if needed <= span:
            continue
        certain = flight.least_time(other, generous=True) > span * (1 + 1 / task.nodes)
        most = relax(document, flight.requirement, flight.height, flight.most(other, span))
        way = number(flight.height - other, "m")
        reason = (
            f"{key('duration', document)}: a {what} of {way} takes {needed:.2f} s, "
            f"{task.duration:g} s in all leave at most {span:.2f} s for it"
        )
        if certain:
            yield Diagnostic(f"{most.placed()}; {reason}", True, (most,), cause=True)
        else:
            yield Diagnostic(reason, False, cause=True)
        return


def _energy(
    task: Task, model: Model, flight: AskedFlight, document: Document
) -> Iterator[Diagnostic]:
    """Work of the air over the stroke against the lift, hips counted generously."""
    air, lift = air_work(model), flight.mass * flight.fall * (flight.height - flight.z0)
    asked = f"`{flight.requirement.text}` ({place(document, flight.requirement.location)})"
    off = _pistons_off(task, document)
    air = 0.0 if off else air
    if lift <= air:
        return
    longest = task.duration * (1 + task.step_variation) * (flight.requirement.at or 1.0)
    causes = [f"{off} keeps the pistons without air"] if off else []
    if task.payload > HEAVY * flight.mass:
        causes.append(f"{key('payload', document)} adds {number(task.payload, 'kg')}")
    lifted = f"{asked}: lifting {flight.mass:.1f} kg to {number(flight.height, 'm')}"
    most = flight.z0 + air / (flight.mass * flight.fall)
    yield Diagnostic(
        "; ".join([*causes, f"{lifted} takes {lift:.0f} J, one stroke of the pistons {air:.0f} J"]),
        lift > STROKES * air + hip_power(model) * longest,
        (relax(document, flight.requirement, flight.height, most),),
        cause=bool(causes),
    )


def _pistons_off(task: Task, document: Document) -> str:
    """The requirement that keeps every extend valve shut all the time, if there is one."""
    for pattern, bound in task.bounds.items():
        closed = bound.equals in (0, 0.0) or bound.at_most in (0, 0.0)
        if closed and "valve" in pattern and "retract" not in pattern and pattern.startswith("*"):
            return f"`bounds.{pattern}` ({place(document, ('bounds', pattern))})"
    return ""


def _grip(
    model: Model, requirements: Sequence[Requirement], document: Document
) -> Iterator[Diagnostic]:
    """A jump to another place from rest needs friction."""
    first = [w for w in requirements if w.at == 0.0 and w.quantity.name == "body/x"]
    last = [w for w in requirements if w.at == 1.0 and w.quantity.name == "body/x"]
    resting = any(w.at == 0.0 and w.location[-1] == "rest" for w in requirements)
    if not (first and last and resting):
        return
    way = max(last[0].lower - first[0].upper, first[0].lower - last[0].upper)
    floors = [e for e in model.effects if e.family == "ground" and "mu" in e.parameters()]
    if way < FORWARD or all(float(e.value("mu")) > 0 for e in floors):
        return
    where = place(document, last[0].location)
    yield Diagnostic(
        f"`{last[0].text}` ({where}): {number(way, 'm')} forward asked, but the ground "
        f"gives no grip: friction coefficient mu is 0 in the model `{model.name}` "
        f"({floors[0].name}), and without it the centre of mass stays where it starts",
        way > leg_swing(model) / model.mechanism.mass,
        cause=True,
    )
