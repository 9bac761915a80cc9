"""Small mechanisms with known motions, through the same Transcription as the robot."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, ClassVar, Literal

import casadi as ca
import numpy as np

from kemba.config import Document
from kemba.effects.base import At, Contribution, Effect, Pair
from kemba.mechanism import Mechanism, Port
from kemba.model import Model
from kemba.ocp.nlp.ipopt import Ipopt, Iterate
from kemba.ocp.task.resolve import resolve
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.symmetry import whole
from kemba.ocp.transcription.transcribe import Parameters, Transcription
from kemba.quantity import Param, Quantity
from kemba.scene.scene import Obstacle, Scene

SHARP = {"tol": 1e-10, "constr_viol_tol": 1e-11, "acceptable_iter": 0}


class Push(Effect):
    """A force along x within +-1 N."""

    kind: Literal["push"] = "push"
    place: ClassVar[Literal["leg", "body"]] = "body"
    ports: ClassVar[tuple[str, ...]] = ("body_x",)

    def inputs(self) -> dict[str, Quantity]:
        return {"F": Quantity("push/F", "N", -1.0, 1.0)}

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"body_x": at.F})


class Spring(Effect):
    """A spring of 4 pi^2 N/m: with 1 kg, one turn a second."""

    kind: Literal["spring"] = "spring"
    place: ClassVar[Literal["leg", "body"]] = "body"
    ports: ClassVar[tuple[str, ...]] = ("body_x",)

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"body_x": -4 * math.pi**2 * at.body_x.x})


class Lag(Effect):
    """A state that follows x with a time constant of 0.1 s."""

    kind: Literal["lag"] = "lag"
    place: ClassVar[Literal["leg", "body"]] = "body"
    ports: ClassVar[tuple[str, ...]] = ("body_x",)

    def states(self) -> dict[str, Quantity]:
        return {"w": Quantity("lag/w", "m")}

    def evaluate(self, at: At) -> Contribution:
        return Contribution(rate={"w": (at.body_x.x - at.w) / 0.1})


class Wire(Effect):
    """A frictionless wire, bent at will: a force across the velocity, which does no work."""

    kind: Literal["wire"] = "wire"
    place: ClassVar[Literal["leg", "body"]] = "body"
    ports: ClassVar[tuple[str, ...]] = ("body_x", "body_z")

    def inputs(self) -> dict[str, Quantity]:
        return {"c": Quantity("wire/turn", "N.s.m-1", -20.0, 20.0)}

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"body_x": -at.c * at.body_z.v, "body_z": at.c * at.body_x.v})


class Leg(Effect):
    """A push of at most `F` upwards, without a reach of its own."""

    kind: Literal["leg"] = "leg"
    place: ClassVar[Literal["leg", "body"]] = "body"
    ports: ClassVar[tuple[str, ...]] = ("body_z",)
    F: Annotated[float, Param("N", lower=0.0)] = 100.0

    def inputs(self) -> dict[str, Quantity]:
        return {"f": Quantity("leg/F", "N", 0.0, float(self.F), 10.0)}

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"body_z": at.f})


class Stroke(Leg):
    """The same from a piston below the mass: it pushes up to z = `s`, not beyond."""

    kind: Literal["stroke"] = "stroke"  # type: ignore[assignment]
    s: Annotated[float, Param("m", lower=0.0)] = 0.1

    def forces(self) -> dict[str, Quantity]:
        return {"over": Quantity("stroke/over", "m", 0.0, 10.0, doc="height above the stroke")}

    def evaluate(self, at: At) -> Contribution:
        beyond = Pair("beyond", at.over - (at.body_z.x - self.s), at.over)
        return Contribution(effort={"body_z": at.f}, pairs=(beyond, Pair("no push", at.f, at.over)))


class Wall(Effect):
    """A wall at x = 1 m that does not throw back."""

    kind: Literal["wall"] = "wall"
    place: ClassVar[Literal["leg", "body"]] = "body"
    ports: ClassVar[tuple[str, ...]] = ("body_x",)

    def forces(self) -> dict[str, Quantity]:
        return {"lam": Quantity("wall/F", "N", 0.0, 1000.0, 1.0)}

    def evaluate(self, at: At) -> Contribution:
        gap = Pair("wall", 1.0 - at.body_x.x, at.lam)
        return Contribution(effort={"body_x": -at.lam}, pairs=(gap,))


def bead(axes: str = "x", gravity: float = 0.0, box: Obstacle | None = None) -> Mechanism:
    """A point of 1 kg that moves along `axes`, falls along z, and keeps out of a box."""
    n = len(axes)
    q, v, a = ca.SX.sym("q", n), ca.SX.sym("v", n), ca.SX.sym("a", n)
    coordinates = tuple(Quantity(f"body/{axis}", "m", -10.0, 10.0) for axis in axes)
    velocities = tuple(Quantity(f"body/v{axis}", "m.s-1", -50.0, 50.0) for axis in axes)
    weight = ca.SX([gravity if axis == "z" else 0.0 for axis in axes])
    named = zip(coordinates, velocities, strict=True)
    ports = {c.name: Port(c, w, q[i]) for i, (c, w) in enumerate(named)}
    scene = Scene(obstacles=(box,) if box else ())
    for room in [box.solid(scene.ground).distance(q[0], q[1])] if box else []:
        port = Port(Quantity("bead/room", "m"), Quantity("bead/room_rate", "m.s-1"), room)
        ports["bead/room"] = port
    known = coordinates, velocities, a + weight, ports, ()
    return Mechanism("bead", q, v, a, *known, gravity=9.81, scene=scene)


def solve(
    mechanism: Mechanism,
    effects: Iterable[Effect],
    start: dict[str, float],
    relaxed: Sequence[float] = (),
    near: Mapping[str, float] | None = None,
    **task: object,
) -> tuple[Transcription, Iterate]:
    """The task solved from straight lines between its start and its end, or an end `near` that is
    not asked for, first with pairs `relaxed` by so much one after the other."""
    document = Document({"start": start, **task})
    wanted = Task.model_validate(document.data)
    model = Model(mechanism, effects)
    requirements = resolve(wanted, model, document)
    program = Transcription(model, wanted, requirements, whole(model.node), wanted.nodes)
    asked = {name: float(bound.equals or 0.0) for name, bound in wanted.end.items()}
    known = {**start, **asked, **(near or {})}
    ends = {c.name: known[c.name] for c in mechanism.coordinates}
    ramp = np.linspace(0.0, 1.0, wanted.nodes + 1)
    q = np.array([start[n] + (ends[n] - start[n]) * ramp for n in ends]).T
    groups = {
        "q": q,
        "v": np.gradient(q, wanted.step, axis=0),
        "s": np.zeros((len(q), len(model.states))),
        "u": np.zeros((len(q), len(model.inputs))),
        "lam": np.zeros((len(q), len(model.forces))),
        "h": np.full((len(q), 1), wanted.step),
    }
    found = Iterate(np.clip(program.layout.pack(groups), program.lower, program.upper))
    for eps in (*relaxed, 0.0):
        found = Ipopt(program, SHARP).solve(found, Parameters(eps=eps).vector(program.nodes))
        assert found.solved, found.ending
    return program, found
