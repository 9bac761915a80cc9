"""What a plain word means in YAML 1.2 (core schema): null, true, 42, 0o17, 1e3, .inf, or a text.

`on`, `yes` and `1_000` are texts, other than in YAML 1.1.
"""

from __future__ import annotations

import math
import re
from typing import Any

NULL = re.compile(r"|~|null|Null|NULL")
BOOL = re.compile(r"true|True|TRUE|false|False|FALSE")
INT = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
FLOAT = re.compile(
    r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?"
    r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)"
)
# in the order in which they are tried
PATTERNS = {"null": NULL, "bool": BOOL, "int": INT, "float": FLOAT}

LONGEST_NUMBER = 40  # digits and signs; a float has 17 that count


def resolve(text: str) -> tuple[str, Any]:
    """The kind of a plain scalar (`null`, `bool`, `int`, `float` or `str`) and its value.

    Raises ValueError, in words for the author, for numbers that no float can hold.
    """
    kind = next((name for name, pattern in PATTERNS.items() if pattern.fullmatch(text)), "str")
    if kind in ("int", "float") and len(text) > LONGEST_NUMBER:
        raise ValueError(f"this number has {len(text)} characters; {LONGEST_NUMBER} are allowed")
    return kind, _VALUES[kind](text)


def _int(text: str) -> int:
    base = {"0o": 8, "0x": 16}.get(text[:2], 10)
    return int(text[2:] if base != 10 else text, base)


def _float(text: str) -> float:
    if text.lower().endswith(("inf", "nan")):
        return float(text.replace(".", ""))
    number = float(text)
    if math.isinf(number):
        raise ValueError(f"'{text}' is larger than any number that can be computed with")
    return number


_VALUES: dict[str, Any] = {
    "null": lambda text: None,
    "bool": lambda text: text.lower() == "true",
    "int": _int,
    "float": _float,
    "str": str,
}
