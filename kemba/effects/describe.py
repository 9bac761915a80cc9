"""The catalogue as data and as a page: what each effect is, from its own definition."""

import inspect
import math
from collections.abc import Iterator
from typing import Any, get_args

from kemba.effects.base import Effect
from kemba.effects.catalogue import BY_KIND, EFFECTS, MISSING, OWN_RIGS, PHYSICAL, PLANNING
from kemba.effects.registry import kind_of
from kemba.errors import KembaError, suggest
from kemba.quantity import Param

INTRODUCTION = """# The catalogue of effects

Written by `kemba-opt effects --markdown`; do not edit. Symbols, per leg: x, v piston extension and
rate; F_e, F_r chamber forces; u_e, u_r valves after the dead time; tau_c a chamber's time constant;
q, w hip angle and rate; tau hip torque. Forces are added to the right-hand side, pushing positive.
At the axis of a drive q, v, a are position, rate and acceleration, tau the motor's force; a rotary
axis has N.m for N and rad for m. On rigs of your own tanh(v/0.01) is tanh(v/sign_speed).
"size" is what would matter in practice, a prior width rather than a limit; that of a scale k is the
size of k - 1. "off" is the value at which an effect is absent; parameters without one are shapes.
"""


def chapters() -> dict[str, tuple[type[Effect], ...]]:
    """The effects known now by the chapters of the catalogue."""
    own = tuple(e for e in EFFECTS if e not in (*PLANNING, *PHYSICAL, *OWN_RIGS, *MISSING))
    found = {
        "The planning model": PLANNING,
        "Physical chambers": PHYSICAL,
        "What rigs of your own bring along": OWN_RIGS,
        "What may be missing": MISSING,
        "Your own": own,
    }
    outside = BY_KIND.outside
    return {**found, "From outside the package": outside} if outside else found


def find_effect(name: str) -> type[Effect]:
    """The effect called `name`, also as in `sensor_bias:body/pitch`. Raises KembaError."""
    kind = name.split(":")[0]
    if kind not in BY_KIND:
        raise KembaError(f"effects {name}", "no such effect", hint=suggest(kind, BY_KIND))
    return BY_KIND[kind]


def describe(effect: type[Effect]) -> dict[str, Any]:
    """Name, equation, parameters with units and sizes, and source of an `effect`, as data."""
    places = effect.place if isinstance(effect.place, str) else "the port it names"
    ports = effect.ports if isinstance(effect.ports, tuple) else ()
    return {
        "name": kind_of(effect),
        "family": effect.family,
        "equation": effect.equation,
        "place": places,
        "ports": list(ports),
        "parameters": [_parameter(effect, name) for name in effect.declared()],
        "tables": [*_tables(effect)],
        "source": effect.source,
        "replaces": list(effect.replaces),
        "dissipative": effect.dissipative,
        "description": inspect.getdoc(effect) or "",
    }


def _parameter(effect: type[Effect], name: str) -> dict[str, Any]:
    param = effect.declared()[name]
    off = effect.off.get(name)
    unit = f"{param.unit} or {param.rotary}" if param.rotary else param.unit
    return {
        "name": name,
        "unit": "channel's" if name in getattr(effect, "in_channel_unit", ()) else unit,
        "size": param.size,
        "default": _usual(effect, effect.model_fields[name].default),
        "off": "infinity" if off is not None and math.isinf(off) else off,
        "lower": param.lower if math.isfinite(param.lower) else None,
        "upper": param.upper if math.isfinite(param.upper) else None,
        "doc": param.doc,
    }


def _tables(effect: type[Effect]) -> Iterator[dict[str, Any]]:
    """Fields with units that are no scalar parameters: tables, and fixed values of the rig."""
    for name, info in effect.model_fields.items():
        param = _param_in(info.annotation)
        if param is not None and name not in effect.declared():
            usual = _usual(effect, info.default)
            yield {"name": name, "unit": param.unit, "default": usual, "doc": param.doc}


def _usual(effect: type[Effect], default: Any) -> Any:
    """A default as text; figures that are None come from the robot's file."""
    if default is not None:
        return default
    own = effect.of_cylinder is not Effect.of_cylinder
    return "that of the robot's cylinder" if own else "as the description says"


def _param_in(annotation: Any) -> Param | None:
    parts = (*getattr(annotation, "__metadata__", ()), *get_args(annotation))
    for part in parts:
        found = part if isinstance(part, Param) else _param_in(part)
        if found is not None:
            return found
    return None


def in_words(parameter: dict[str, Any]) -> str:
    """A parameter of `describe` on one line: `F_c (N) 10, off at 0`."""
    text = f"{parameter['name']} ({parameter['unit']}) {parameter['size']:g}"
    off = parameter["off"]
    if off is None:
        return text
    return f"{text}, off at {off if isinstance(off, str) else f'{off:g}'}"


def page() -> str:
    """The catalogue in Markdown (docs/effects.md)."""
    lines = [INTRODUCTION]
    for chapter, effects in chapters().items():
        lines += [f"## {chapter}\n", "| name | equation | parameters (unit), size | source |"]
        lines += ["|---|---|---|---|", *(_row(describe(effect)) for effect in effects), ""]
    return "\n".join(lines)


def _row(found: dict[str, Any]) -> str:
    parameters = "; ".join(in_words(p) for p in found["parameters"])
    equation = found["equation"].replace("|", "\\|")
    return f"| `{found['name']}` | {equation} | {parameters} | {found['source']} |"
