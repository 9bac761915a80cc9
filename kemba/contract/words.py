"""Promises about what an effect says of itself: documentation, units, YAML."""

from __future__ import annotations

import json
import math

from kemba.config import Document, parse
from kemba.config.document import dump_text, load_text
from kemba.contract.cases import Broken, Placed
from kemba.model.spec import ModelSpec
from kemba.quantity import is_si


def documented(placed: Placed) -> None:
    """Docstring, family, equation and source; every parameter has an SI unit and a meaning."""
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
    """`off` names declared parameters, lies within their bounds and is their default."""
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
    """Written to YAML and read again it is the same effect."""
    text = dump_text({"effects": [placed.on.listed()]})
    found = parse(load_text(text, "round trip"), ModelSpec).effects
    if found != (placed.on,):
        raise Broken(f"{placed.on!r} came back as {found!r}")
    json.dumps(placed.on.listed())
    parse(Document({"effects": [placed.on.listed()]}), ModelSpec)


def schema_names_units(placed: Placed) -> None:
    """The JSON Schema tells the unit of every parameter."""
    schema = json.dumps(placed.effect.model_json_schema())
    for name, param in placed.effect.declared().items():
        if f'"unit": "{param.unit}"' not in schema:
            raise Broken(f"{name}: the schema does not name its unit {param.unit}")
