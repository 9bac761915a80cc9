"""What every effect of the catalogue promises, tried on each of them."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from contract.cases import (
    BY_KIND,
    KINDS,
    example,
    model_of,
    placed,
    points,
    slopes,
    values_of,
    with_slopes,
    without,
)

from kemba.config import parse
from kemba.config.document import dump_yaml, load_yaml
from kemba.effects.sensors import SensorEffect
from kemba.effects.series import Series
from kemba.model.spec import ModelSpec
from kemba.ocp.transcription.symmetry import find_symmetry
from kemba.quantity import is_si


def of(*kinds: str) -> pytest.MarkDecorator:
    """The test for these kinds."""
    return pytest.mark.parametrize("kind", kinds)


EVERY = of(*KINDS)
SWITCHED = of(*(k for k in KINDS if BY_KIND[k].off))
ON_ONE_LEG = of(*(k for k in KINDS if BY_KIND[k].off and BY_KIND[k].place == "leg"))
DISSIPATIVE = of(*(k for k in KINDS if BY_KIND[k].dissipative))
BENCH = [k for k in KINDS if set(example(k).ports) <= {"piston"} and k != "end_stop"]
LOPSIDED = {"com_offset"}  # a mirror image of theirs is another value


@EVERY
def test_is_documented(kind: str) -> None:
    effect = BY_KIND[kind]
    assert effect.__doc__ and effect.__doc__ != effect.__base__.__doc__
    assert effect.family and effect.equation and effect.source
    for name, param in effect.declared().items():
        assert is_si(param.unit) and param.doc, f"{kind}.{name}"
        assert math.isfinite(param.size) and param.size > 0
    for role in ("states", "inputs", "forces"):
        for quantity in getattr(example(kind), role)().values():
            assert is_si(quantity.unit) and quantity.doc, f"{kind}: {quantity.name}"


@EVERY
def test_off_value_is_admissible(kind: str) -> None:
    effect = BY_KIND[kind]
    assert set(effect.off) <= set(effect.declared())
    for name, off in effect.off.items():
        param = effect.declared()[name]
        assert param.lower <= off <= param.upper
        if math.isfinite(off):
            assert effect.model_fields[name].default == off, "listed without a value: off"
    assert set(example(kind).shapes()).isdisjoint(effect.off)


@EVERY
def test_yaml_round_trip(kind: str, tmp_path: Path) -> None:
    effect = example(kind)
    dump_yaml({"effects": [effect.listed()]}, tmp_path / "model.yaml")
    assert parse(load_yaml(tmp_path / "model.yaml"), ModelSpec).effects == (effect,)
    json.dumps(effect.listed())


@EVERY
def test_schema_names_units(kind: str) -> None:
    schema = json.dumps(BY_KIND[kind].model_json_schema())
    for param in BY_KIND[kind].declared().values():
        assert f'"unit": "{param.unit}"' in schema


@pytest.mark.parametrize("kind, rig", [*((k, False) for k in KINDS), *((k, True) for k in BENCH)])
def test_residual_and_gradient_are_finite(kind: str, rig: bool) -> None:
    _, model = placed(kind, rig)
    both, p = with_slopes(kind, rig)
    for point in points(model):
        for name, value in both(**point, p=p).items():
            assert np.isfinite(np.asarray(value)).all(), f"{kind}: {name} at {point}"


@EVERY
def test_every_parameter_matters(kind: str) -> None:
    effect = example(kind)
    if isinstance(effect, SensorEffect):
        time = np.linspace(0.0, 1.0, 2001)
        true = Series(time, np.sin(9 * time), (9 * np.cos(9 * time),))
        assert np.abs(effect.measured(true).value - true.value).max() > 1e-3
        assert effect.undone(effect.measured(true)).value == pytest.approx(true.value, abs=1e-3)
        return
    if effect.timing():
        for name in effect.parameters():
            later = effect.bind({name: effect.value(name) + 0.001})
            assert later.timing() != effect.timing()
        return
    _, model = placed(kind)
    both, p = with_slopes(kind)
    slope = sum(np.abs(np.asarray(both(**point, p=p)["dp"])) for point in points(model, 12))
    for i, name in enumerate(effect.parameters()):
        bounds = effect.bind({name: 1.1 * effect.value(name)}).inputs() != effect.inputs()
        assert bounds or slope[:, i].max() > 1e-9, f"{kind}.{name} changes nothing"


@EVERY
def test_nominal_figures_exist_and_matter(kind: str) -> None:
    """What a fit leaves free within a tolerance is a figure of the effect and changes the model."""
    effect, model = placed(kind)
    assert set(effect.nominal) <= set(type(effect).model_fields)
    assert all(t.source and t.sigma > 0 and t.unit for t in effect.nominal.values())
    tolerances = effect.tolerances()
    assert all(0.0 < share <= 0.1 for share in tolerances.values())
    assert {name.partition("[")[0] for name in tolerances} >= set(effect.nominal)
    if not tolerances:
        return
    scaled = slopes(model, [], [f"{effect.name}.{figure}" for figure in tolerances])
    ones = [1.0] * len(tolerances)
    slope = sum(np.abs(np.asarray(scaled(**x, p=ones)["dp"])) for x in points(model, 12))
    for i, figure in enumerate(tolerances):
        assert slope[:, i].max() > 1e-9, f"{kind}.{figure} changes nothing"


@SWITCHED
def test_off_is_absent(kind: str) -> None:
    effect = BY_KIND[kind]
    off = example(kind).bind(effect.off)
    model = model_of(off)
    base = without(model, off.name)
    if effect.replaces:
        base = model_of()
    kept = [i for i, key in enumerate(model.states) if key in base.states]
    for point in points(model):
        point["s"] = settled(model, point, kept)
        forces = np.array(
            [dict(zip(model.forces, point["lam"], strict=True))[k] for k in base.forces]
        )
        there = {**point, "s": point["s"][kept], "sd": point["sd"][kept], "lam": forces}
        found, wanted = values_of(model, point), values_of(base, there)
        found["rate"] = found["rate"][kept]
        if effect.replaces:  # same pairs under another name, hence in another order
            for part in ("pair_a", "pair_b"):
                found[part], wanted[part] = np.sort(found[part]), np.sort(wanted[part])
        for part, value in wanted.items():
            np.testing.assert_allclose(found[part], value, rtol=1e-6, atol=1e-6, err_msg=part)


def settled(model, point, kept):
    """Effect states with those that are not `kept` at rest: their rates are linear in them."""
    own = [i for i in range(len(model.states)) if i not in kept]
    s = np.array(point["s"], dtype=float)
    if not own:
        return s
    for i in own:
        s[i] = list(model.states.values())[i].value
    start = values_of(model, {**point, "s": s})["rate"][own]
    slope = np.zeros((len(own), len(own)))
    for column, i in enumerate(own):
        moved = s.copy()
        moved[i] += 1e-3
        slope[:, column] = (values_of(model, {**point, "s": moved})["rate"][own] - start) / 1e-3
    s[own] -= np.linalg.solve(slope, start)
    return s


@DISSIPATIVE
def test_dissipative_ones_dissipate(kind: str) -> None:
    effect, model = placed(kind)
    base = without(model, effect.name)
    lost = []
    for point in points(model, 12):
        change = values_of(model, point)["dynamics"] - values_of(base, point)["dynamics"]
        lost.append(float(point["v"] @ change))
    assert min(lost) >= -1e-9
    assert max(lost) > 1e-6


@EVERY
def test_order_of_the_list_does_not_matter(kind: str) -> None:
    _, model = placed(kind)
    turned = type(model)(model.mechanism, model.effects[::-1], model.supply)
    for point in points(model, 2):
        for part, value in values_of(model, point).items():
            np.testing.assert_allclose(values_of(turned, point)[part], value, rtol=1e-12)


@EVERY
def test_keeps_the_mirror(kind: str) -> None:
    _, model = placed(kind)
    assert (find_symmetry(model) is not None) == (kind not in LOPSIDED)


@ON_ONE_LEG
def test_one_leg_only(kind: str) -> None:
    effect = BY_KIND[kind]
    one = example(kind).model_copy(update={"on": "rear"})
    assert one.name == f"{kind}:rear"
    model = model_of(one)
    labels = [i.label for i in model.instances]
    assert f"rear/{kind}:rear" in labels and f"front/{kind}:rear" not in labels
    for replaced in effect.replaces:
        assert f"front/{replaced}" in labels
    assert np.isfinite(values_of(model, next(iter(points(model))))["dynamics"]).all()
