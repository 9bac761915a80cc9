"""What is hidden in a machine: effects by name, put where they belong in bodies, air and drives."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kemba.mechanism.links import Link, Robot

from .air import FirstOrder, Flaws, Orifice, jittered
from .mjcf import Build, Contact, Flex

LEGS = ("front", "rear")
Values = dict[str, float]


@dataclass(frozen=True)
class Boom:
    """The boom about its pivot (SI); its levers differ as the body hangs below its end."""

    inertia: float = 4.82
    mass: float = 2.699
    com: float = 1.149
    lever: tuple[float, float] = (2.575, 2.493)  # horizontal, vertical
    extra: float = 0.0  # kg, inertia without weight
    damping: float = 0.0
    friction: float = 0.0
    spring: float = 0.0
    rest: float = 0.2836  # m, height at which the spring is slack


@dataclass(frozen=True)
class Drive:
    """One hip: gain and lag of its torque, and what its bearing takes."""

    gain: float = 1.0
    lag: float = 0.0
    friction: float = 0.0
    damping: float = 0.0
    rotor: float = 0.0


STIFF = Flex(5e5, 60.0)  # a boom that bends by less than the noise
HARD = Contact()


@dataclass(frozen=True)
class Machine:
    """One machine. `late` [s]: later on and off, by leg; `read`: share by which the boom's encoders
    read too much, by axis; `joint`: dry friction [N] and damping [N s/m] of the rods, by leg."""

    robot: Robot
    boom: Boom = Boom()
    air: tuple[FirstOrder | Orifice, ...] = (FirstOrder(), FirstOrder())
    contact: Contact = HARD
    flex: Flex | None = STIFF
    flaws: tuple[Flaws, Flaws] = (Flaws(), Flaws())
    drives: tuple[Drive, Drive] = (Drive(), Drive())
    seal: tuple[float, float] = (0.0, 0.0)
    rod: tuple[float, float] = (0.0, 0.0)
    late: tuple[tuple[float, float], ...] = ((0.0, 0.0), (0.0, 0.0))
    droop: tuple[float, float] = (0.0, 0.3)
    force: float = 0.0  # N, on the body, upwards
    payload: float = 0.0
    com: float = 0.0
    pitch: float = 0.0  # N m, dry friction
    read: tuple[float, float] = (0.0, 0.0)

    def build(self, step: float = 5e-5) -> Build:
        """All that MuJoCo has to know."""
        inertia = [self.boom.inertia / lever**2 + self.boom.extra for lever in self.boom.lever]
        joints: dict[str, dict[str, Any]] = {
            axis: {"armature": m, "damping": self.boom.damping, **_dry(self.boom.friction)}
            for axis, m in zip("xz", inertia, strict=True)
        }
        if self.boom.spring:
            joints["z"] |= {"stiffness": self.boom.spring, "springref": self.boom.rest}
        joints["pitch"] = _dry(self.pitch)
        for i, leg in enumerate(LEGS):
            d = self.drives[i]
            rotor = self.robot.leg.rotor_inertia + d.rotor
            joints[f"{leg}/hip"] = {"armature": rotor, "damping": d.damping, **_dry(d.friction)}
            joints[f"{leg}/rod"] = {"damping": self.rod[i], **_dry(self.seal[i])}
        return Build(step, self.contact, self.flex, joints, self.payload, self.com)

    @property
    def lift(self) -> float:
        """Steady vertical force on the boom's end [N], its weight included."""
        boom = self.boom
        return self.force - boom.mass * self.robot.gravity * boom.com / boom.lever[1]


def machine(
    robot: Robot, effects: Sequence[dict[str, Any]] = (), air: str = "first_order", **changes: Any
) -> Machine:
    """The machine of a robot's file with hidden effects, as plain data: kind, on, parameters."""
    figures = {"first_order": FirstOrder(), "orifice": Orifice()}[air]
    return applied(replace(Machine(robot, air=(figures, figures)), **changes), effects)


def applied(found: Machine, effects: Sequence[dict[str, Any]]) -> Machine:
    """The machine with these effects in it."""
    for effect in effects:
        legs = {"both": (0, 1), "front": (0,), "rear": (1,)}[effect.get("on", "both")]
        name = effect["kind"].split(":")[0]
        found = APPLIED[name](found, legs, {**effect["parameters"], "of": effect["kind"]})
    return found


def off_by(made: Machine, share: float, rng: np.random.Generator) -> Machine:
    """The machine with every nominal figure off by about `share` (1 sigma)."""

    def one(value: float) -> float:
        return value * (1.0 + share * float(np.clip(rng.standard_normal(), -2.5, 2.5)))

    def link(of: Link) -> Link:
        return of.model_copy(update={"mass": one(of.mass), "inertia": one(of.inertia)})

    leg = made.robot.leg
    parts = {n: link(getattr(leg, n)) for n in ("femur", "tibia", "cylinder", "rod")}
    leg = leg.model_copy(update={**parts, "rotor_inertia": one(leg.rotor_inertia)})
    robot = made.robot.model_copy(update={"body": link(made.robot.body), "leg": leg})
    boom = replace(made.boom, inertia=one(made.boom.inertia), mass=one(made.boom.mass))
    air = tuple(jittered(figures, rng, share) for figures in made.air)
    return replace(made, robot=robot, boom=boom, air=air)


def _dry(loss: float) -> dict[str, Any]:
    return {"frictionloss": loss, "solreffriction": "0.001 1"} if loss else {}


Applied = Callable[[Machine, Sequence[int], Values], Machine]


def _of_leg(field_name: str, *pairs: tuple[str, str]) -> Applied:
    """An effect whose parameters are fields of a per-leg part of the machine."""

    def apply(made: Machine, legs: Sequence[int], values: Values) -> Machine:
        parts = list(getattr(made, field_name))
        for i in legs:
            parts[i] = replace(parts[i], **{to: values[of] for of, to in pairs if of in values})
        return replace(made, **{field_name: tuple(parts)})

    return apply


def _number_of_leg(field_name: str, of: str) -> Applied:
    def apply(made: Machine, legs: Sequence[int], values: Values) -> Machine:
        parts = list(getattr(made, field_name))
        for i in legs:
            parts[i] = values[of]
        return replace(made, **{field_name: tuple(parts)})

    return apply


def _of_boom(of: str, to: str) -> Applied:
    return lambda made, legs, values: replace(made, boom=replace(made.boom, **{to: values[of]}))


def _whole(of: str, to: str) -> Applied:
    return lambda made, legs, values: replace(made, **{to: values[of]})


def _late(both: bool) -> Applied:
    def apply(made: Machine, legs: Sequence[int], values: Values) -> Machine:
        late = [list(pair) for pair in made.late]
        for i in legs:
            late[i][1] += values["dt"]
            late[i][0] += values["dt"] if both else 0.0
        return replace(made, late=tuple(map(tuple, late)))

    return apply


def _length(made: Machine, legs: Sequence[int], values: Values) -> Machine:
    row, name = str(values["of"]).split(":")[1].split("/")
    leg = made.robot.leg
    table = getattr(leg, row)
    table = table.model_copy(update={name: getattr(table, name) + values["d"]})
    leg = leg.model_copy(update={row: table})
    return replace(made, robot=made.robot.model_copy(update={"leg": leg}))


def _lever(made: Machine, legs: Sequence[int], values: Values) -> Machine:
    """A longer boom: it moves as it does, and its encoders still count with the drawn lever."""
    drawn = made.boom.lever
    true = (drawn[0] * (1.0 + values["k"]), drawn[1] * (1.0 + values["k"]))
    read = (drawn[0] / true[0] - 1.0, drawn[1] / true[1] - 1.0)
    return replace(made, boom=replace(made.boom, lever=true), read=read)


def _split(made: Machine, legs: Sequence[int], values: Values) -> Machine:
    """Mass that is in the links of the legs and not in the body, spread as these are heavy."""
    robot, m = made.robot, values["m"]
    rows = ("femur", "tibia", "cylinder", "rod")
    carried = len(robot.legs) * sum(getattr(robot.leg, row).mass for row in rows)
    leg = robot.leg.model_copy(
        update={row: heavier(getattr(robot.leg, row), 1.0 + m / carried) for row in rows}
    )
    body = heavier(robot.body, 1.0 - m / robot.body.mass)
    return replace(made, robot=robot.model_copy(update={"leg": leg, "body": body}))


def heavier(link: Link, factor: float) -> Link:
    """A link of the same shape whose mass is `factor` times as large."""
    return link.model_copy(update={"mass": factor * link.mass, "inertia": factor * link.inertia})


def _bends(made: Machine, legs: Sequence[int], values: Values) -> Machine:
    c = 2.0 * 0.03 * np.sqrt(values["k"] * 0.65)  # 3 % of critical with the reduced mass
    return replace(made, flex=Flex(values["k"], float(c)))


def _grip(made: Machine, legs: Sequence[int], values: Values) -> Machine:
    return replace(made, contact=replace(made.contact, mu=made.contact.mu * values["mu"]))


def _droop(made: Machine, legs: Sequence[int], values: Values) -> Machine:
    return replace(made, droop=(values["D"], values.get("T", 0.3)))


APPLIED: dict[str, Applied] = {
    "valve_delay": _late(True),
    "valve_close_delay": _late(False),
    "supply_scale": _of_leg("flaws", ("k", "supply")),
    "supply_droop": _droop,
    "rise_time_scale": _of_leg("flaws", ("k", "rise")),
    "hose_lag": _of_leg("flaws", ("T", "hose")),
    "cross_leak": _of_leg("flaws", ("k", "leak")),
    "both_mode_loss": _of_leg("flaws", ("F", "both")),
    "gas_spring": _of_leg("flaws", ("k", "spring")),
    "end_cushion": _of_leg("flaws", ("c", "cushion"), ("L", "cushion_way")),
    "pressure_friction": _of_leg("flaws", ("mu", "pressure")),
    "quadratic_damping": _of_leg("flaws", ("c", "quadratic")),
    "seal_friction": _number_of_leg("seal", "F_c"),
    "piston_damping": _number_of_leg("rod", "c"),
    "hip_friction": _of_leg("drives", ("T_c", "friction")),
    "hip_damping": _of_leg("drives", ("b", "damping")),
    "torque_scale": _of_leg("drives", ("k", "gain")),
    "motor_lag": _of_leg("drives", ("T", "lag")),
    "rotor_inertia": _of_leg("drives", ("J", "rotor")),
    "payload": _whole("m", "payload"),
    "com_offset": _whole("d", "com"),
    "boom_force": _whole("F", "force"),
    "pitch_friction": _whole("T", "pitch"),
    "boom_inertia": _of_boom("m", "extra"),
    "boom_damping": _of_boom("b", "damping"),
    "boom_friction": _of_boom("F", "friction"),
    "boom_spring": _of_boom("k", "spring"),
    "ground_friction": _grip,
    "geometry": _length,
    "boom_lever": _lever,
    "mass_split": _split,
    # outside the catalogue
    "flexible_boom": _bends,
    "magnet": _of_leg("flaws", ("F0", "magnet"), ("d", "magnet_way")),
    "check_valve": _of_leg("flaws", ("c", "check")),
}
