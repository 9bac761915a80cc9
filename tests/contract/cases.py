"""Every effect of the catalogue, switched on and placed in a model that suits it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache
from typing import Any

import casadi as ca
import numpy as np

from kemba.effects import BY_KIND, EFFECTS, Effect
from kemba.effects.catalogue import PHYSICAL, SENSORS
from kemba.model import Model, load_spec
from kemba.model.spec import build_model

MAGNET = {
    "name": "magnet",
    "on": "piston",
    "force": "-F0*exp(-(x/d)**2)",
    "parameters": {"F0": "8 N", "d": "5 mm"},
}
REQUIRED: dict[str, dict[str, Any]] = {
    **{kind.model_fields["kind"].default: {"channel": "body/pitch"} for kind in SENSORS},
    "expression": MAGNET,
}
KINDS = sorted(BY_KIND)


def example(kind: str, sign: float = 1.0) -> Effect:
    """The effect as it matters in practice: off value plus size, or its defaults."""
    effect = BY_KIND[kind]
    values = {}
    for name, off in effect.off.items():
        size = effect.declared()[name].size
        values[name] = size if math.isinf(off) else off + sign * size
    return effect.model_validate({"kind": kind, **REQUIRED.get(kind, {}), **values})


def model_of(*effects: Effect, rig: bool = False) -> Model:
    """The planning model, or with orifice chambers where an effect needs them, and `effects`."""
    physical = any(isinstance(e, PHYSICAL) for e in effects)
    spec = load_spec("planning")
    if physical:
        spec = spec.model_copy(update={"chambers": "orifice"})
    model = build_model(spec, rig=rig)
    return model.with_effects(effects)


@cache
def placed(kind: str, rig: bool = False) -> tuple[Effect, Model]:
    """The example of a kind, and the model that it stands in."""
    effect = example(kind)
    return effect, model_of(effect, rig=rig)


@cache
def with_slopes(kind: str, rig: bool = False) -> tuple[ca.Function, list[Any]]:
    """The `slopes` of that model by the effect's parameters, and their values."""
    effect, model = placed(kind, rig)
    names = list(effect.parameters())
    return slopes(model, [f"{effect.name}.{n}" for n in names]), [effect.value(n) for n in names]


def without(model: Model, name: str) -> Model:
    """The model less one effect."""
    rest = [e for e in model.effects if e.name != name]
    return Model(model.mechanism, rest, model.supply, model.name)


def points(model: Model, count: int = 6, seed: int = 1) -> Iterator[dict[str, np.ndarray]]:
    """Random states of a model and its borders: at rest, pistons retracted, feet on the ground,
    chambers empty or full, no force."""
    rng = np.random.default_rng(seed)
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
        if mechanism.imposed:
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


def values_of(model: Model, point: dict[str, np.ndarray], p: Any = ()) -> dict[str, np.ndarray]:
    """Every part of the residual at a point."""
    result = model.node.residual(**point, p=list(p))
    return {name: np.asarray(value).ravel() for name, value in result.items()}


def slopes(model: Model, free: list[str], scaled: list[str] | None = None) -> ca.Function:
    """Residual and its derivatives by every variable, by the parameters `free` and by factors on
    the figures `scaled`."""
    node = model.build(free, scaled or ())
    parts = [node.dynamics, node.rate, node.pair_a, node.pair_b, node.limits]
    F = ca.vertcat(*parts)
    y = ca.vertcat(node.q, node.v, node.a, node.s, node.lam, node.u)
    columns = [node.outputs[o.name] for o in node.output_quantities]
    results = [F, ca.jacobian(F, y), ca.jacobian(ca.vertcat(F, *columns), node.p)]
    return ca.Function("slopes", node.symbols, results, list(node.NAMES), ["F", "dy", "dp"])


assert len(EFFECTS) == len(BY_KIND), "two effects of one kind"
