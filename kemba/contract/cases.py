"""An effect switched on, placed in a model that suits it, and points at which to evaluate it."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from kemba.effects import Effect
from kemba.effects.catalogue import PHYSICAL
from kemba.effects.pneumatics.gas import GasTemperature
from kemba.effects.registry import kind_of
from kemba.effects.sensors import SensorEffect
from kemba.errors import KembaError
from kemba.mechanism.own_rigs import CylinderRig, DriveRig, Load, VesselRig
from kemba.model import Model, load_spec
from kemba.model.spec import build_model, own_model

Array = np.ndarray
Point = dict[str, Array]

# values of the fields that have no default, of effects that kemba ships
REQUIRED: dict[str, dict[str, Any]] = {
    "expression": {
        "name": "magnet",
        "on": "piston",
        "force": "-F0*exp(-(x/d)**2)",
        "parameters": {"F0": "8 N", "d": "5 mm"},
    },
    "geometry": {"part": "femur/length"},
}


# a pendulum, so that every figure of a drive matters
OWN_RIGS = (
    CylinderRig(bore=0.025, rod=0.010, stroke=0.070),
    DriveRig(motion="rotary", inertia=0.5, load=Load(mass=1.0, arm=0.2)),
    VesselRig(volume=0.016, orifice=2.7e-3),
)


class Broken(Exception):  # noqa: N818  a promise that is not kept, no fault of this program
    """An effect does not keep a promise; the text says which and where."""


def example(effect: type[Effect]) -> Effect:
    """The effect at a typical strength: `off` value plus size, other values at their defaults.
    Raises Broken when a field has no default."""
    values: dict[str, Any] = {}
    for name, off in effect.off.items():
        size = effect.declared()[name].size
        values[name] = size if math.isinf(off) else off + size
    required = REQUIRED.get(kind_of(effect), {})
    if issubclass(effect, SensorEffect):
        required = {"channel": "body/pitch"}
    given = {"kind": kind_of(effect), **required, **values}
    bare = [n for n, f in effect.model_fields.items() if f.is_required() and n not in given]
    if bare and not required:
        raise Broken(f"the field '{bare[0]}' has no default, so it cannot be a candidate")
    return effect.model_validate(given)


def model_of(*effects: Effect, rig: bool = False) -> Model:
    """The first machine on which `effects` stand, with them: the planning model, the same with
    orifice chambers, with air that has a temperature, then a cylinder, a drive, a vessel.

    `rig`: the bench piston in the place of the robot. Raises KembaError when none suits.
    """
    physical = any(isinstance(effect, PHYSICAL) for effect in effects)
    first: KembaError | None = None
    for machine in _machines(rig, physical):
        try:
            model = machine().with_effects(effects)
            _ = model.node
        except KembaError as error:
            first = first or error
        else:
            return model
    assert first is not None
    raise first


def _machines(rig: bool, physical: bool) -> Iterator[Callable[[], Model]]:
    spec = load_spec("planning")
    orifice = spec.model_copy(update={"chambers": "orifice"})
    if not physical:
        yield lambda: build_model(spec, rig=rig)
    yield lambda: build_model(orifice, rig=rig)
    yield lambda: build_model(orifice, [GasTemperature()], rig=rig)
    for own in OWN_RIGS:
        yield lambda own=own: own_model(own)  # type: ignore[misc]


def without(model: Model, name: str) -> Model:
    """The model without one effect."""
    rest = [e for e in model.effects if e.name != name]
    return Model(model.mechanism, rest, model.supply, model.name)


@dataclass(frozen=True)
class Placed:
    """A kind of effect, switched on in a model of the robot, or with `rig` of the bench piston."""

    effect: type[Effect]
    rig: bool = False

    @cached_property
    def on(self) -> Effect:
        """The effect, switched on."""
        return example(self.effect)

    @cached_property
    def resolved(self) -> Effect:
        """The effect with the figures that it takes from the model, such as its cylinder's."""
        return self.model.effect(self.on.name)

    @cached_property
    def model(self) -> Model:
        """The model that contains it."""
        return model_of(self.on, rig=self.rig)

    @cached_property
    def slopes(self) -> ca.Function:
        """`slopes` of that model by the effect's own parameters."""
        return slopes(self.model, [f"{self.on.name}.{n}" for n in self.resolved.parameters()])

    @cached_property
    def values(self) -> list[Any]:
        """The values of those parameters."""
        return [self.resolved.value(n) for n in self.resolved.parameters()]

    @property
    def fits_rig(self) -> bool:
        """Whether it can act on the bench piston."""
        return set(self.on.ports) <= {"piston"} and self.on.kind != "end_stop"


def points(model: Model, count: int = 6) -> Iterator[Point]:
    """States of a model: three at its borders, the others at random.

    At the borders: at rest, pistons retracted, feet on the ground, chambers empty or full, no
    force. Arrays by the names of `Node.NAMES` except p.
    """
    rng = np.random.default_rng(1)
    mechanism = model.mechanism
    stand = np.array([mechanism.standing.get(c.name, 0.0) for c in mechanism.coordinates])
    states = list(model.states.values())
    low = np.array([q.lower for q in states])
    high = np.array([min(q.upper, q.value + 4 * q.scale) for q in states])
    rest = np.array([q.value for q in states])
    n, nl = mechanism.n, len(model.forces)
    for i in range(count):
        border = i < 3
        q = stand + (0.0 if border else 1.0) * 0.02 * rng.standard_normal(n)
        if mechanism.imposed and not mechanism.rig:
            q = np.array([[0.0], [mechanism.stroke], [0.5 * mechanism.stroke]][min(i, 2)])
        yield {
            "q": q,
            "v": np.zeros(n) if i == 0 else rng.standard_normal(n),
            "a": np.zeros(n) if i == 0 else 5.0 * rng.standard_normal(n),
            "s": [rest, low, high][i] if border else rest + (high - rest) * rng.random(len(states)),
            "sd": np.zeros(len(states)),
            "lam": np.zeros(nl) if border else 100.0 * rng.random(nl),
            "u": np.array([float(rng.integers(2)) for _ in model.inputs]),
        }


def values_of(model: Model, point: Point) -> Point:
    """Every part of the residual at a point."""
    result = model.node.residual(**point, p=[])
    return {name: np.asarray(value).ravel() for name, value in result.items()}


def slopes(model: Model, free: Sequence[str], scaled: Sequence[str] = ()) -> ca.Function:
    """The residual F, its derivatives dy by every variable, and dp by the parameters `free` and by
    factors on the figures `scaled`."""
    node = model.build(free, scaled)
    parts = [node.dynamics, node.rate, node.pair_a, node.pair_b, node.limits]
    F = ca.vertcat(*parts)
    y = ca.vertcat(node.q, node.v, node.a, node.s, node.lam, node.u)
    columns = [node.outputs[o.name] for o in node.output_quantities]
    results = [F, ca.jacobian(F, y), ca.jacobian(ca.vertcat(F, *columns), node.p)]
    return ca.Function("slopes", node.symbols, results, list(node.NAMES), ["F", "dy", "dp"])
