"""The one list of checks, and running them."""

import json
import math
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from kemba.config import Document, parse
from kemba.config.document import dump_text, load_text
from kemba.contract import physics
from kemba.contract.cases import Broken, Placed
from kemba.effects import Effect
from kemba.effects.catalogue import DRIVE, OWN_RIGS
from kemba.effects.registry import kind_of
from kemba.errors import KembaError
from kemba.model.spec import ModelSpec
from kemba.quantity import is_si


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

    @property
    def doc(self) -> str:
        """What is promised, in one sentence."""
        return (self.run.__doc__ or "").split("\n")[0]


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

    Raises Broken where it is not so.
    """
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
    """`off` names declared parameters, lies within their bounds and is their default.

    Raises Broken where it is not so.
    """
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
    """Written to YAML and read again it is the same effect.

    Raises Broken where it is not so.
    """
    text = dump_text({"effects": [placed.on.listed()]})
    found = parse(load_text(text, "round trip"), ModelSpec).effects
    if found != (placed.on,):
        raise Broken(f"{placed.on!r} came back as {found!r}")
    json.dumps(placed.on.listed())
    parse(Document({"effects": [placed.on.listed()]}), ModelSpec)


def schema_names_units(placed: Placed) -> None:
    """The JSON Schema names the unit of every parameter.

    Raises Broken where it is not so.
    """
    schema = json.dumps(placed.effect.model_json_schema())
    for name, param in placed.effect.declared().items():
        if f'"unit": "{param.unit}"' not in schema:
            raise Broken(f"{name}: the schema does not name its unit {param.unit}")


CHECKS = (
    Check(documented),
    Check(off_is_admissible),
    Check(yaml_round_trip),
    Check(schema_names_units),
    Check(physics.finite),
    Check(physics.every_parameter_matters),
    Check(physics.off_is_absent, lambda effect: bool(effect.off)),
    Check(physics.dissipates, lambda effect: effect.dissipative),
    Check(physics.order_does_not_matter),
    Check(physics.supply_can_be_left_open),
    Check(physics.keeps_the_mirror, _on_legs),
    Check(physics.one_leg_only, lambda effect: bool(effect.off) and _on_legs(effect)),
    Check(physics.sensor_fault_can_be_undone, physics.measures),
    Check(physics.nominal_figures_matter, physics.moves),
)
