"""Values that have broken programs: sizes, signs, units, expressions, names, nesting."""

import copy
from typing import Any

from hypothesis import strategies as st

NUMBERS = [0, 1, -1, 2, 1e-12, 1e12, 1e300, -1e300, 5e-324, 10**39, 0.1, 1e6, 2**63, -0.0]
TEXTS = [
    "", " ", "0.5 m", "7 bar", "-3 kg", "1e400", "1e308 m", "5 m/s^2", "3 furlong", "nan", "inf",
    "9**9**9**9", "-" * 400 + "1", "v*10**400", "log(9**9**9)", "x/0", "tanh(v / 0.1)", "sin(",
    "../../../x", "/etc/passwd", ".", "..", "a/b", "con", "x" * 300, "a\x00b", "\u202egpj", "é",
    "<script>", "=1+1", "on", "yes", "null", "{}", "[]", "planning", "kemba", "front", "valve",
    "body/z", "contact", "height", "start", "%s%n", "${HOME}", "0x10", "1_000", "2026-01-01",
]  # fmt: skip
ODD: list[Any] = [None, True, False, [], {}, [[]], {"": 0}, [None], {"a": {"b": {"c": 1}}}]

numbers = st.one_of(
    st.sampled_from(NUMBERS),
    st.floats(allow_nan=False, allow_infinity=False),
    st.integers(-1000, 1000),
)
texts = st.one_of(st.sampled_from(TEXTS), st.text(max_size=12))
odd: st.SearchStrategy[Any] = st.sampled_from(ODD).map(copy.deepcopy)
anything: st.SearchStrategy[Any] = st.one_of(
    numbers, texts, odd, st.lists(st.one_of(numbers, texts), max_size=4)
)
