"""The one list of checks, and running them: what an effect promises about its texts and numbers.

Its numbers are finite, off is absent, friction takes energy away.
"""

import json
import math
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kemba.config import Document, parse
from kemba.config.document import dump_text, load_text
from kemba.contract.cases import (
    Broken,
    Placed,
    Point,
    example,
    model_of,
    points,
    slopes,
    values_of,
    without,
)
from kemba.effects.base import Effect
from kemba.effects.catalogue import DRIVE, OWN_RIGS
from kemba.effects.registry import kind_of
from kemba.effects.sensors import SensorEffect
from kemba.effects.series import Series
from kemba.errors import KembaError
from kemba.model import SUPPLY, Model
from kemba.model.spec import ModelSpec
from kemba.quantity import is_si

SEEN = 1e-3  # of a channel of size 1: a sensor fault that changes less is none
# of a channel of size 1: error that undoing a fault may leave (a shift in time reads between
# rows 0.5 ms apart)
UNDONE = 1e-3
WIDEST = 0.1  # a figure less certain than this is a parameter to fit, no tolerance
# slope of the residual below which a figure has no influence (far above rounding errors, far
# below what matters)
NOTHING = 1e-9
POWER = 1e-6  # W; rounding of a dissipated power


def finite(placed: Placed) -> None:
    """Residual and slopes are finite at random states and at the borders, on robot and rig. Raises
    Broken otherwise."""
    for case in (placed, Placed(placed.effect, rig=True)) if placed.fits_rig else (placed,):
        for point in points(case.model):
            for name, value in case.slopes(**point, p=case.values).items():
                if not np.isfinite(np.asarray(value)).all():
                    part = {"F": "residual", "dy": "slope", "dp": "slope by the parameters"}[name]
                    where = "rig" if case.rig else "robot"
                    raise Broken(f"its {part} is not finite on the {where} at v = {point['v']}")


def every_parameter_matters(placed: Placed) -> None:
    """Each parameter changes what the effect does. Raises Broken otherwise."""
    effect = placed.on
    if isinstance(effect, SensorEffect):
        return  # see `measuring`
    if effect.timing():
        for name in effect.parameters():
            if effect.bind({name: effect.value(name) + 0.001}).timing() == effect.timing():
                raise Broken(f"{name} changes no time")
        return
    effect = placed.resolved
    slope = sum(
        np.abs(np.asarray(placed.slopes(**point, p=placed.values)["dp"]))
        for point in points(placed.model, 12)
    )
    for i, name in enumerate(effect.parameters()):
        moves_bounds = effect.bind({name: 1.1 * effect.value(name)}).inputs() != effect.inputs()
        if not moves_bounds and slope[:, i].max() <= NOTHING:
            raise Broken(f"{name} changes nothing")


def off_is_absent(placed: Placed) -> None:
    """At its off value the model is the same as without the effect. Raises Broken otherwise."""
    off = placed.on.bind(placed.effect.off)
    model = model_of(off)
    base = model_of() if off.replaces else without(model, off.name)
    kept = [i for i, key in enumerate(model.states) if key in base.states]
    for point in points(model):
        point["s"] = settled(model, point, kept)
        named = dict(zip(model.forces, point["lam"], strict=True))
        forces = np.array([named[key] for key in base.forces])
        there = {**point, "s": point["s"][kept], "sd": point["sd"][kept], "lam": forces}
        found, wanted = values_of(model, point), values_of(base, there)
        found["rate"] = found["rate"][kept]
        if off.replaces:  # same pairs under another name, hence in another order
            for part in ("pair_a", "pair_b"):
                found[part], wanted[part] = np.sort(found[part]), np.sort(wanted[part])
        for part, value in wanted.items():
            if not same(found[part], value, 1e-6, 1e-6):
                raise Broken(f"switched off it still changes the {part}")


def settled(model: Model, point: Point, kept: list[int]) -> np.ndarray:
    """Effect states (ns,) at a point; those that are not `kept` are at rest.

    Their rates must be linear in them. A state without a rate keeps its value. Units as in the
    model.
    """
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
    s[own] -= np.linalg.lstsq(slope, start, rcond=None)[0]  # what has no rate stays where it is
    return s


def dissipates(placed: Placed) -> None:
    """A dissipative effect never adds energy, and it takes some. Raises Broken otherwise."""
    base = without(placed.model, placed.on.name)
    lost = []
    for point in points(placed.model, 12):
        change = values_of(placed.model, point)["dynamics"] - values_of(base, point)["dynamics"]
        lost.append(float(point["v"] @ change))
    if min(lost) < -NOTHING:
        raise Broken(f"it gives {-min(lost):.3g} W; `dissipative` says that it only takes")
    if max(lost) <= POWER:
        raise Broken("it takes no energy at all")


def order_does_not_matter(placed: Placed) -> None:
    """The order of a model's list changes nothing. Raises Broken otherwise."""
    model = placed.model
    turned = Model(model.mechanism, model.effects[::-1], model.supply)
    for point in points(model, 2):
        for part, value in values_of(model, point).items():
            if not same(values_of(turned, point)[part], value, 1e-12, 0.0):
                raise Broken(f"the {part} depends on the order of the list")


def supply_can_be_left_open(placed: Placed) -> None:
    """With the supply as a symbol, as in simulations that share equations, nothing changes. Raises
    Broken otherwise."""
    model = placed.model
    node = model.build([SUPPLY])
    for point in points(model, 2):
        found = node.residual(**point, p=[model.supply])
        for part, value in values_of(model, point).items():
            if not same(np.asarray(found[part]).ravel(), value, 1e-9, 1e-9):
                raise Broken(f"the {part} is another where the supply is a symbol")


def keeps_the_mirror(placed: Placed) -> None:
    """With an effect on every leg the model keeps the mirror symmetry of its robot. Raises Broken
    otherwise."""
    from kemba.ocp.transcription.symmetry import find_symmetry

    if find_symmetry(placed.model) is None:
        raise Broken("the model loses its mirror; see `mirror` in docs/extending.md")


def one_leg_only(placed: Placed) -> None:
    """With `on` it acts at that leg and does not change the others. Raises Broken otherwise."""
    legs = placed.model.mechanism.legs
    here, other, kind = legs[-1], legs[0], placed.on.kind
    one = example(placed.effect).model_copy(update={"on": here})
    model = model_of(one)
    labels = [instance.label for instance in model.instances]
    if one.name != f"{kind}:{here}" or f"{here}/{one.name}" not in labels:
        raise Broken(f"'on: {here}' does not place it there")
    if len(legs) > 1 and f"{other}/{one.name}" in labels:
        raise Broken(f"'on: {here}' places it at {other} too")
    for replaced in one.replaces:
        if len(legs) > 1 and f"{other}/{replaced}" not in labels:
            raise Broken(f"at {other} the effect '{replaced}' is gone")
    if not np.isfinite(values_of(model, next(iter(points(model))))["dynamics"]).all():
        raise Broken("its residual is not finite")


def same(found: np.ndarray, wanted: np.ndarray, rtol: float, atol: float) -> bool:
    """Whether two arrays of equal shape (any, ...) agree within numpy's tolerances."""
    return found.shape == wanted.shape and bool(np.allclose(found, wanted, rtol=rtol, atol=atol))


def sensor_fault_can_be_undone(placed: Placed) -> None:
    """A sensor fault changes what is measured, and `undone` is the inverse of `measured`. Raises
    Broken otherwise."""
    fault = placed.on
    if not isinstance(fault, SensorEffect):
        return
    time = np.linspace(0.0, 1.0, 2001)
    true = Series(time, np.sin(9 * time), (9 * np.cos(9 * time),))
    shown = fault.measured(true)
    if np.abs(shown.value - true.value).max() <= SEEN:
        raise Broken("it changes nothing that is measured")
    if np.abs(fault.undone(shown).value - true.value).max() > UNDONE:
        raise Broken("`undone` does not give back the input of `measured`")


def nominal_figures_matter(placed: Placed) -> None:
    """What a fit leaves free within a tolerance is a figure of the effect and changes the model.
    Raises Broken otherwise."""
    effect = placed.resolved
    for name, tolerance in effect.nominal.items():
        if name not in type(effect).model_fields:
            raise Broken(f"`nominal` names '{name}', which is no field")
        if not getattr(effect, name):
            raise Broken(f"{name} has a tolerance, but no value")
        if not tolerance.source:
            raise Broken(f"{name}: its tolerance has no source")
    tolerances = effect.tolerances()
    for figure, share in tolerances.items():
        if not 0.0 < share <= WIDEST:
            expected = f"0 to {WIDEST:g} expected"
            raise Broken(f"{figure}: its tolerance is {share:g} of it; {expected}")
    missing = set(effect.nominal) - {name.partition("[")[0] for name in tolerances}
    if missing:
        raise Broken(f"`tolerances` leaves '{sorted(missing)[0]}' out")
    if not tolerances:
        return
    scaled = slopes(placed.model, [], [f"{effect.name}.{figure}" for figure in tolerances])
    ones = [1.0] * len(tolerances)
    found = [np.abs(scaled(**x, p=ones)["dp"].full()) for x in points(placed.model, 12)]
    largest = np.max(found, axis=(0, 1))
    for figure, slope in zip(tolerances, largest, strict=True):
        if slope <= NOTHING:
            raise Broken(f"{figure} has a tolerance, but it changes nothing")


def _on_legs(effect: type[Effect]) -> bool:
    return effect.place == "leg" and effect not in (*DRIVE, *OWN_RIGS)


@dataclass(frozen=True)
class Check:
    """A promise: `run` raises Broken when an effect does not keep it."""

    run: Callable[[Placed], None]
    applies: Callable[[type[Effect]], bool] = lambda effect: True

    @property
    def name(self) -> str:
        """Its name in words: `off is absent`."""
        return self.run.__name__.replace("_", " ")


@dataclass(frozen=True)
class CheckResult:
    """How a check of an effect ended; `sentence` says what is wrong."""

    effect: str
    check: Check
    good: bool
    sentence: str = ""


def examine(effect: type[Effect]) -> Iterator[CheckResult]:
    """Every check that applies to an effect; its own exceptions are results too."""
    placed = Placed(effect)
    for check in CHECKS:
        if check.applies(effect):
            try:
                check.run(placed)
            except (Broken, KembaError) as error:
                yield CheckResult(kind_of(effect), check, False, str(error))
            except Exception as error:
                yield CheckResult(kind_of(effect), check, False, _raised(error))
            else:
                yield CheckResult(kind_of(effect), check, True)


def _raised(error: Exception) -> str:
    """An exception with the line that raised it."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    own = [f for f in traceback.extract_tb(error.__traceback__) if f.name in ("evaluate", "states")]
    frame = own[-1] if own else frame
    text = str(error).splitlines()[0] if str(error) else ""
    return f"{type(error).__name__} at {Path(frame.filename).name}:{frame.lineno}: {text}"


def documented(placed: Placed) -> None:
    """Docstring, family, equation and source are there; every parameter has an SI unit and a doc.
    Raises Broken otherwise."""
    effect = placed.effect
    if not effect.__doc__ or effect.__doc__ == effect.__base__.__doc__:
        raise Broken("the class has no docstring")
    for name in ("family", "equation", "source"):
        if not getattr(effect, name):
            raise Broken(f"`{name}` is empty")
    for name, param in effect.declared().items():
        if not is_si(param.unit):
            raise Broken(f"{name}: '{param.unit}' is not an SI unit")
        if not param.doc:
            raise Broken(f"{name}: its Param has no doc")
        if not (math.isfinite(param.size) and param.size > 0):
            raise Broken(f"{name}: its size is {param.size}; a positive number was expected")
    for role in ("states", "inputs", "forces"):
        for quantity in getattr(placed.on, role)().values():
            if not (is_si(quantity.unit) and quantity.doc):
                raise Broken(f"{quantity.name}: an SI unit and a doc were expected")


def off_is_admissible(placed: Placed) -> None:
    """`off` names declared parameters, lies within their bounds and is their default. Raises Broken
    otherwise."""
    effect = placed.effect
    for name, off in effect.off.items():
        if name not in effect.declared():
            raise Broken(f"`off` names '{name}', which is no parameter")
        param = effect.declared()[name]
        if not param.lower <= off <= param.upper:
            raise Broken(f"{name}: the off value {off:g} is outside {param.bounds}")
        if math.isfinite(off) and effect.model_fields[name].default != off:
            raise Broken(f"{name}: its default must be its off value {off:g}")
    both = set(placed.on.shapes()) & set(effect.off)
    if both:
        raise Broken(f"{sorted(both)[0]} is a shape and in `off`")


def yaml_round_trip(placed: Placed) -> None:
    """Written to YAML and read again it is the same effect. Raises Broken otherwise."""
    text = dump_text({"effects": [placed.on.listed()]})
    found = parse(load_text(text, "round trip"), ModelSpec).effects
    if found != (placed.on,):
        raise Broken(f"{placed.on!r} came back as {found!r}")
    json.dumps(placed.on.listed())
    parse(Document({"effects": [placed.on.listed()]}), ModelSpec)


def schema_names_units(placed: Placed) -> None:
    """The JSON Schema names the unit of every parameter. Raises Broken otherwise."""
    schema = json.dumps(placed.effect.model_json_schema())
    for name, param in placed.effect.declared().items():
        if f'"unit": "{param.unit}"' not in schema:
            raise Broken(f"{name}: the schema does not name its unit {param.unit}")


CHECKS = (
    Check(documented),
    Check(off_is_admissible),
    Check(yaml_round_trip),
    Check(schema_names_units),
    Check(finite),
    Check(every_parameter_matters),
    Check(off_is_absent, lambda effect: bool(effect.off)),
    Check(dissipates, lambda effect: effect.dissipative),
    Check(order_does_not_matter),
    Check(supply_can_be_left_open),
    Check(keeps_the_mirror, _on_legs),
    Check(one_leg_only, lambda effect: bool(effect.off) and _on_legs(effect)),
    Check(sensor_fault_can_be_undone, lambda effect: issubclass(effect, SensorEffect)),
    Check(nominal_figures_matter, lambda effect: effect.moves),
)
