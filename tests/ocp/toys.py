"""Small mechanisms with known motions, through the same Transcription as the robot."""

import math
from collections.abc import Iterable
from typing import ClassVar, Literal

import casadi as ca
import numpy as np

from kemba.config import Document
from kemba.effects.base import At, Contribution, Effect
from kemba.mechanism import Mechanism, Port
from kemba.model import Model
from kemba.ocp.nlp.ipopt import Ipopt, Iterate
from kemba.ocp.task.resolve import resolve
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.symmetry import whole
from kemba.ocp.transcription.transcribe import Parameters, Transcription
from kemba.quantity import Quantity

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


def bead(axes: str = "x", gravity: float = 0.0) -> Mechanism:
    """A point of 1 kg that moves along `axes`, and falls along z."""
    n = len(axes)
    q, v, a = ca.SX.sym("q", n), ca.SX.sym("v", n), ca.SX.sym("a", n)
    coordinates = tuple(Quantity(f"body/{axis}", "m", -10.0, 10.0) for axis in axes)
    velocities = tuple(Quantity(f"body/v{axis}", "m.s-1", -50.0, 50.0) for axis in axes)
    weight = ca.SX([gravity if axis == "z" else 0.0 for axis in axes])
    named = zip(coordinates, velocities, strict=True)
    ports = {c.name: Port(c, w, q[i]) for i, (c, w) in enumerate(named)}
    return Mechanism("bead", q, v, a, coordinates, velocities, a + weight, ports, (), gravity=9.81)


def solve(
    mechanism: Mechanism, effects: Iterable[Effect], start: dict[str, float], **task: object
) -> tuple[Transcription, Iterate]:
    """The task solved from straight lines between its start and its end."""
    document = Document({"start": start, **task})
    wanted = Task.model_validate(document.data)
    model = Model(mechanism, effects)
    requirements = resolve(wanted, model, document)
    program = Transcription(model, wanted, requirements, whole(model.node), wanted.nodes)
    ends = {
        c.name: float(wanted.end[c.name].equals or 0.0) if c.name in wanted.end else start[c.name]
        for c in mechanism.coordinates
    }
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
    guess = Iterate(np.clip(program.layout.pack(groups), program.lower, program.upper))
    found = Ipopt(program, SHARP).solve(guess, Parameters(eps=0.0).vector(program.nodes))
    assert found.solved, found.ending
    return program, found
