"""What a log's sidecar file says, checked: its kind and the noise of its channels."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from kemba.errors import KembaError, suggest
from kemba.quantity import Quantity, convert, to_si


def check_kind(kind: Any, kinds: Collection[str], where: str) -> str:
    """The kind of a log. Raises KembaError where it is none of `kinds`."""
    if isinstance(kind, str) and kind in kinds:
        return kind
    named = " or ".join(f"'kind: {k}'" for k in kinds)
    near = suggest(kind, kinds) if isinstance(kind, str) else ""
    hint = near if near.startswith("did you") else ""  # they are all named already
    raise KembaError(f"{where}: kind", f"'{kind}' is no kind of log", f"{named} was expected", hint)


def check_noise(
    noise: Any, units: Mapping[str, str], where: str
) -> tuple[dict[str, float], dict[str, float]]:
    """Noise (1 sigma, in the column's SI unit) by channel without unit, and the correlation time
    [s] of those channels that have one; `units` by channel.

    A channel is written as in the log, with or without its unit. The value is a number in that
    unit, a text such as '0.3 mm', or a group such as `{sigma: 0.3 mm, time: 10 ms}`. Raises
    KembaError where it is no positive finite number.
    """
    if noise is None:
        return {}, {}
    if not isinstance(noise, Mapping):
        expected = "one line per channel was expected, such as 'piston/F [N]: 0.5'"
        raise KembaError(f"{where}: noise", f"'{noise}' names no channel", expected)
    found, times = {}, {}
    for key, value in noise.items():
        name = str(key).split(" [")[0]
        if name not in units:
            continue
        place, unit = f"{where}: noise: {key}", units[name]
        written = Quantity.from_header(str(key)).unit if "[" in str(key) else unit
        if isinstance(value, Mapping):
            value, times[name] = _group(value, place)
        sigma = _positive(value, written, unit, place, f"the column is '{name} [{unit}]'")
        found[name] = sigma
    return found, times


def _group(value: Mapping[str, Any], place: str) -> tuple[Any, float]:
    """Sigma as written, and correlation time [s], of a group."""
    if set(value) != {"sigma", "time"}:
        keys = ", ".join(map(str, value)) or "nothing"
        expected = "'{sigma: 0.3 mm, time: 10 ms}' was expected"
        raise KembaError(place, f"the group has {keys}", expected)
    return value["sigma"], _positive(value["time"], "s", "s", f"{place}: time")


def _positive(value: Any, written: str, unit: str, place: str, hint: str = "") -> float:
    """A number above 0 in `unit`, `written` in another one; `hint` where it is of another kind."""
    try:
        number = convert(to_si(value, written), written, unit)
    except ValueError as error:
        raise KembaError(place, str(error), hint=hint) from None
    if not number > 0.0:
        what = f"the value is {value}; no sensor is without noise"
        hint = "leave the line out: the noise is then learnt from the log"
        raise KembaError(place, what, f"a number above 0 in {unit} was expected", hint)
    return float(number)
