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
    hint = suggest(kind, kinds) if isinstance(kind, str) else ""
    raise KembaError(f"{where}: kind", f"'{kind}' is no kind of log", f"{named} was expected", hint)


def check_noise(noise: Any, units: Mapping[str, str], where: str) -> dict[str, float]:
    """Noise (1 sigma, in the column's SI unit) by channel without unit; `units` by channel.

    A channel is written as in the log, with or without its unit; the value is a number in that
    unit or a text such as '0.3 mm'. Raises KembaError where it is no positive finite number.
    """
    if noise is None:
        return {}
    if not isinstance(noise, Mapping):
        expected = "one line per channel was expected, such as 'piston/F [N]: 0.5'"
        raise KembaError(f"{where}: noise", f"'{noise}' names no channel", expected)
    found = {}
    for key, value in noise.items():
        name = str(key).split(" [")[0]
        if name not in units:
            continue
        place, unit = f"{where}: noise: {key}", units[name]
        written = Quantity.from_header(str(key)).unit if "[" in str(key) else unit
        try:
            sigma = convert(to_si(value, written), written, unit)
        except ValueError as error:
            raise KembaError(place, str(error)) from None
        if not sigma > 0.0:
            what = f"the noise is {value}; no sensor is without noise"
            hint = "leave the line out: the noise is then learnt from the log"
            raise KembaError(place, what, f"a number above 0 in {unit} was expected", hint)
        found[name] = float(sigma)
    return found
