"""A task that asks for a flight: what it lifts, how far, and what the robot can give."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kemba.model import Model
from kemba.model.rest import at_rest
from kemba.ocp.infeasibility.pose import Poses
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.terrain import ground_at, stands


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
