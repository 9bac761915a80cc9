"""What is never exactly as drawn: nominal figures that every fit leaves free by a few percent."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, ClassVar, Literal

import casadi as ca
import numpy as np

from kemba.effects.base import At, Contribution, Effect
from kemba.mechanism.pin_model import build_pin_model
from kemba.mechanism.recursion import Joint, read_joints, rnea
from kemba.mechanism.robot import tree_angles
from kemba.model.model import Model
from kemba.quantity import Param
from kemba.settings import Settings, setting

Share = Annotated[float, Param("1", 0.02)]
Damping = Annotated[float, Param("N.s.m-1", 2.0)]


class ToleranceShareSettings(Settings):
    """How well the figures of a robot are known."""

    share: float = setting(
        0.02,
        "1",
        "prior sigma of a nominal figure, as a share of it",
        "convention: nominal figures are off by 1 to 3 %",
        decides=True,
    )


class AirTolerance(Effect):
    """One leg's cylinder as built: chamber forces off by a share, damping per valve mode."""

    kind: Literal["air_tolerance"] = "air_tolerance"
    extend: Share = 0.0
    retract: Share = 0.0
    c_none: Damping = 0.0
    c_extend: Damping = 0.0
    c_retract: Damping = 0.0
    c_both: Damping = 0.0

    family: ClassVar[str] = "piston"
    ports: ClassVar[tuple[str, ...]] = ("piston",)

    def evaluate(self, at: At) -> Contribution:
        e, r = at.u_e, at.u_r
        c = (
            self.c_none * (1 - e) * (1 - r)
            + self.c_extend * e * (1 - r)
            + self.c_retract * (1 - e) * r
            + self.c_both * e * r
        )
        force = self.extend * at.F_e - self.retract * at.F_r - c * at.piston.v
        return Contribution(effort={"piston": force})


def with_tolerances(model: Model) -> tuple[Model, ca.SX, dict[str, tuple[float, float]]]:
    """The model with its cylinders' tolerances, the symbols of the further ones, and of all the
    nuisance parameters nominal value and prior sigma; those of `further` come last."""
    share = ToleranceShareSettings.current().share
    further: list[ca.SX] = []
    late: dict[str, tuple[float, float]] = {}
    effects: list[Effect] = []
    for effect in model.effects:
        if effect.kind != "chamber":
            effects.append(effect)
            continue
        for leg in _places(effect, model):
            shares = [ca.SX.sym(f"{leg}:{i}") for i in range(4)]
            further += shares
            late |= {f"tolerance.{leg}.{n}": (0.0, share) for n in ("f0", "f1", "v0", "v1")}
            fill, vent = effect.fill, effect.vent  # type: ignore[attr-defined]
            scaled = [c * (1 + x) for c, x in zip((*fill, *vent), shares, strict=True)]
            effects.append(effect.bind({"on": leg, "fill": scaled[:2], "vent": scaled[2:]}))
    nuisance: dict[str, tuple[float, float]] = {}
    if any(e.kind == "chamber" or "F_e" in e.states() for e in model.effects):
        for leg in model.mechanism.legs:
            tolerance = AirTolerance.model_validate({"on": leg})
            effects.append(tolerance)
            for name, param in tolerance.parameters().items():
                nuisance[f"{tolerance.name}.{name}"] = (0.0, param.size)
    for name in ("boom.inertia", "boom.mass"):
        if name in model.parameters:
            value = model.parameters[name][1]
            nuisance[name] = (value, share * value)
    built = Model(model.mechanism, effects, model.supply, model.name)
    return built, ca.SX(ca.vertcat(*further)), nuisance | late


def _places(effect: Effect, model: Model) -> Sequence[str]:
    return (effect.on,) if effect.on else model.mechanism.legs


def mass_regressors(model: Model) -> tuple[tuple[str, ...], ca.Function]:
    """Names and (q, v, a) -> (n, k): forces per share by which a link's mass or inertia is off."""
    m = model.mechanism
    robot = m.need_robot()
    tree = tree_angles(robot, m.q)
    rate = ca.jtimes(tree, m.q, m.v)
    acc = ca.jtimes(rate, m.q, m.v) + ca.jtimes(tree, m.q, m.a)
    joints = read_joints(build_pin_model(robot))
    names, columns = [], []
    for i, joint in enumerate(joints):
        if not joint.mass:
            continue
        light = [_bare(j) if k != i else replace(j, armature=0.0) for k, j in enumerate(joints)]
        point = [replace(j, inertia=0.0) for j in light]
        whole = rnea(light, tree, rate, acc, robot.gravity)
        mass = rnea(point, tree, rate, acc, robot.gravity)
        for what, force in (("mass", mass), ("inertia", whole - mass)):
            names.append(f"tolerance.{joint.name}.{what}")
            columns.append(ca.jtimes(tree, m.q, force, True))
    return tuple(names), ca.Function("regress", [m.q, m.v, m.a], [ca.horzcat(*columns)])


def _bare(joint: Joint) -> Joint:
    return replace(joint, mass=0.0, inertia=0.0, armature=0.0, com=np.zeros(2))
