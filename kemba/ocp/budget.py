"""Energy, time and friction that a flight needs, against what the robot can give."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from kemba.config import Document
from kemba.mechanism import load_robot
from kemba.model import Model
from kemba.ocp.finding import Finding, key, number, place, relax
from kemba.ocp.pose import Poses
from kemba.ocp.task import Task
from kemba.ocp.wishes import Wish

HEAVY = 0.2  # of all that is lifted, from which the payload is told
STROKES = 3  # more pushes than this fit into no planned motion


@dataclass(frozen=True)
class Flight:
    """A height that asks for a flight, and what is known about it before solving.

    z0, reach, top [m]: heights of the body at the start, on a stretched leg pitched up
    (generous), and on stretched legs when level; mass [kg], fall [m.s-2] with boom and payload.
    """

    wish: Wish
    height: float
    z0: float
    reach: float
    top: float
    mass: float
    fall: float
    lands: bool
    stays_below: bool

    def rise(self, generous: bool) -> float:
        """Seconds from the last touch of the ground to the apex, at least."""
        from_height = self.reach + 0.1 if generous else self.top
        return float(np.sqrt(2 * max(self.height - from_height, 0.0) / self.fall))


def flight_of(task: Task, model: Model, wishes: Sequence[Wish], poses: Poses) -> Flight | None:
    """The flight that the highest wish on the body's height asks for, from a start at rest."""
    highest = [w for w in wishes if w.quantity.name == "body/z" and w.at and np.isfinite(w.lower)]
    start = [w for w in wishes if w.at == 0.0]
    resting = any(w.location[-1] == "rest" for w in start)
    grounded = any(w.quantity.name.endswith("foot/z") and w.upper <= 1e-6 for w in start)
    if not highest or not resting or not grounded:
        return None
    wish = max(highest, key=lambda w: w.lower)
    robot = load_robot(model.mechanism.name)
    leg = robot.leg.femur.length + robot.leg.tibia.length
    lever = max(abs(place.hip) for place in robot.legs.values())
    if wish.lower <= leg:
        return None
    mass, weight = inertia_and_weight(model)
    z0 = poses.highest(start)
    return Flight(
        wish,
        wish.lower,
        leg if z0 is None else z0,
        leg + lever,
        leg,
        mass,
        weight / mass,
        any(w.quantity.name.endswith("foot/z") and w.at == 1.0 and w.upper < 0.1 for w in wishes),
        any(w.quantity.name == "body/z" and w.at is None and w.upper <= wish.lower for w in wishes),
    )


def inertia_and_weight(model: Model) -> tuple[float, float]:
    """What the body's height feels in free fall: mass [kg] and weight [N], all effects counted."""
    node = model.node
    row = [c.name for c in model.mechanism.coordinates].index("body/z")
    q = np.array([model.mechanism.standing[c.name] for c in model.mechanism.coordinates])
    still, zeros = np.zeros(len(q)), [0.0 * np.ones(x.numel()) for x in (node.s, node.lam, node.u)]

    def force(a: float) -> float:
        up = a * (np.arange(len(q)) == row)
        s, lam, u = zeros
        found = node.residual(q, still, up, s, s, lam, u, np.zeros(node.p.numel()))
        return float(found[0][row])

    return abs(force(1.0) - force(0.0)), abs(force(0.0))


def air_work(model: Model) -> float:
    """Energy [J] that all pistons give over one stroke, at their steady force from the supply."""
    node, stroke = model.node, model.mechanism.stroke
    q = np.array([model.mechanism.standing[c.name] for c in model.mechanism.coordinates])
    v, lam = np.zeros(len(q)), np.zeros(node.lam.numel())
    u = np.array([float(symbol == "u_e") for _, symbol in model.inputs])
    s0 = np.array([s.value for s in model.states.values()])
    p = np.zeros(node.p.numel())

    def rate(_: float, s: np.ndarray) -> np.ndarray:
        return -np.array(node.residual(q, v, v, s, 0 * s, lam, u, p)[1]).ravel()

    s = solve_ivp(rate, (0.0, 0.5), s0, method="LSODA", rtol=1e-4).y[:, -1] if len(s0) else s0
    measured = np.array(node.measure(q, v, v, s, 0 * s, lam, u, p)).ravel()
    forces = [
        value
        for quantity, value in zip(node.output_quantities, measured, strict=True)
        if quantity.name.endswith("piston/F")
    ]
    return float(sum(max(f, 0.0) for f in forces) * stroke)


def hip_power(model: Model) -> float:
    """Mechanical power [W] of all hips at most: peak torque at no-load speed, generously."""
    hips = [e for e in model.effects if e.kind == "motor"]
    legs = len(model.mechanism.legs)
    return sum(float(e.value("tau_peak") * e.value("w_noload")) * legs for e in hips)


def budget_findings(
    task: Task,
    model: Model,
    wishes: Sequence[Wish],
    flight: Flight | None,
    document: Document,
) -> Iterator[Finding]:
    """Time, energy, valves and friction of a task."""
    if flight is not None:
        yield from _time(task, flight, document)
        yield from _energy(task, model, flight, document)
    yield from _grip(model, wishes, document)


def _time(task: Task, flight: Flight, document: Document) -> Iterator[Finding]:
    """Ballistic rise to the apex, and the fall from it, within the steps allowed."""
    longest = task.duration * (1 + task.step_variation)
    before = longest * (flight.wish.at or 0.0)
    spans = []
    if flight.stays_below and before < longest:
        spans.append(("rise to it", before))
    if flight.lands and before < longest:
        spans.append(("fall from it", longest - before))
    for what, span in spans:
        needed, surely = flight.rise(generous=False), flight.rise(generous=True)
        if needed <= span:
            continue
        room = flight.fall * span**2 / 2
        most = relax(document, flight.wish, flight.height, flight.top + room)
        yield Finding(
            f"{key('duration', document)}: {most}: the {what} takes {needed:.2f} s of free "
            f"flight, {task.duration:g} s in all leave {span:.2f} s for it ({most.where})",
            surely > span,
            (most,),
        )
        return


def _energy(task: Task, model: Model, flight: Flight, document: Document) -> Iterator[Finding]:
    """Work of the air over the stroke against the lift, hips counted generously."""
    air, lift = air_work(model), flight.mass * flight.fall * (flight.height - flight.z0)
    asked = f"`{flight.wish.text}` ({place(document, flight.wish.location)})"
    off = _pistons_off(task, document)
    air = 0.0 if off else air
    if lift <= air:
        return
    longest = task.duration * (1 + task.step_variation) * (flight.wish.at or 1.0)
    causes = [f"{off} keeps the pistons without air"] if off else []
    if task.payload > HEAVY * flight.mass:
        causes.append(f"{key('payload', document)} adds {number(task.payload, 'kg')}")
    lifted = f"{asked}: lifting {flight.mass:.1f} kg to {number(flight.height, 'm')}"
    most = flight.z0 + air / (flight.mass * flight.fall)
    yield Finding(
        "; ".join([*causes, f"{lifted} takes {lift:.0f} J, one stroke of the pistons {air:.0f} J"]),
        lift > STROKES * air + hip_power(model) * longest,
        (relax(document, flight.wish, flight.height, most),),
        cause=bool(causes),
    )


def _pistons_off(task: Task, document: Document) -> str:
    """The wish that keeps every extend valve shut all the time, if there is one."""
    for pattern, bound in task.bounds.items():
        closed = bound.equals in (0, 0.0) or bound.at_most in (0, 0.0)
        if closed and "valve" in pattern and "retract" not in pattern and pattern.startswith("*"):
            return f"`bounds.{pattern}` ({place(document, ('bounds', pattern))})"
    return ""


def _grip(model: Model, wishes: Sequence[Wish], document: Document) -> Iterator[Finding]:
    """A jump to another place from rest needs friction."""
    first = [w for w in wishes if w.at == 0.0 and w.quantity.name == "body/x"]
    last = [w for w in wishes if w.at == 1.0 and w.quantity.name == "body/x"]
    resting = any(w.at == 0.0 and w.location[-1] == "rest" for w in wishes)
    if not (first and last and resting):
        return
    way = max(last[0].lower - first[0].upper, first[0].lower - last[0].upper)
    floors = [e for e in model.effects if e.family == "ground" and "mu" in e.parameters()]
    if not floors or all(float(e.value("mu")) > 0 for e in floors):
        return
    leg = load_robot(model.mechanism.name).leg
    outer = leg.femur.length + leg.tibia.com
    rod = leg.piston.mount + leg.piston.retracted + leg.piston.stroke
    arms = leg.femur.mass * leg.femur.com + leg.tibia.mass * outer
    arms += leg.cylinder.mass * (leg.piston.mount + leg.cylinder.com) + leg.rod.mass * rod
    # the body moves at most as far as the legs' masses swing from one side to the other
    swing = 2 * len(model.mechanism.legs) * arms / model.mechanism.mass
    if way < 0.01:
        return
    where = place(document, last[0].location)
    yield Finding(
        f"`{last[0].text}` ({where}): {number(way, 'm')} forward asked, but the ground "
        f"gives no grip: friction coefficient mu is 0 in the model `{model.name}` "
        f"({floors[0].name}), and without it the centre of mass stays where it starts",
        way > swing,
        cause=True,
    )
