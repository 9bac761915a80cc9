"""The answer to "which effect is missing?", as people and scripts read it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

import numpy as np

from kemba.identify.settings import DiscoverSettings

Verdict = Literal["missing", "nothing", "unknown", "bad-data"]


@dataclass(frozen=True)
class Value:
    """An estimate with its 95 % interval."""

    value: float
    low: float
    high: float
    unit: str

    def __str__(self) -> str:
        width = max(self.high - self.low, 1e-12 * max(abs(self.value), 1e-12))
        digits = 2 + int(np.ceil(np.log10(max(abs(self.value) / width, 1.0))))
        digits = min(digits, 5)
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"{self.value:.{digits}g}{unit} ({self.low:.{digits}g} to {self.high:.{digits}g})"


@dataclass(frozen=True)
class Ranked:
    """One effect of the ranking."""

    effect: str
    probability: float
    parameters: dict[str, Value]
    equivalent_to: tuple[str, ...] = ()
    error_before: float = float("nan")
    error_after: float = float("nan")
    holdout_gain_nats: float = float("nan")


@dataclass
class Answer:
    """What `discover` answers; `json()` is its machine-readable form."""

    verdict: Verdict
    p_value_nothing: float = float("nan")
    sentence: str = ""
    ranking: Sequence[Ranked] = ()
    added: tuple[str, ...] = ()
    error_before: float = float("nan")
    error_after: float = float("nan")
    noise_floor: float = 1.0
    smallest_detectable: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    formula: str | None = None
    split_by: str = ""
    model: str | None = None
    runtime_s: float = 0.0
    remarks: Sequence[str] = ()
    ladder: Sequence[tuple[str, float]] = ()  # step, held-out error

    def json(self) -> dict[str, Any]:
        return asdict(self)


def phrase(answer: Answer) -> str:
    """The verdict in one plain sentence."""
    if answer.verdict == "nothing":
        what = "Nothing is missing as far as these data can tell"
        if answer.p_value_nothing <= DiscoverSettings.current().significant:
            what = "What differs is too small to matter"
        return (
            f"{what} (p = {answer.p_value_nothing:.2g}); "
            f"the error is {answer.error_after:.2f} times the noise."
        )
    if answer.verdict == "unknown":
        more = f" A formula that fits: {answer.formula}." if answer.formula else ""
        why = f": {answer.remarks[0]}" if answer.remarks else ""
        return f"Something is missing that no effect of the catalogue explains{why}.{more}"
    parts = [r for r in answer.ranking if r.effect in answer.added]
    named = " and ".join(_named(r) for r in parts)
    before, after = f"{answer.error_before:.2f}", f"{answer.error_after:.2f}"
    falls = f"falls from {before} to {after}"
    if float(after) >= float(before):
        falls = f"was {before} and is {after}"
    return f"Missing: {named}; the held-out error {falls} times the noise.{_doubt(parts)}"


def _named(ranked: Ranked) -> str:
    values = ", ".join(f"{name} = {value}" for name, value in ranked.parameters.items())
    return f"{ranked.effect} ({values})"


def _doubt(parts: Sequence[Ranked]) -> str:
    texts = [
        f" These data cannot tell {r.effect} from {', '.join(r.equivalent_to)}."
        for r in parts
        if r.equivalent_to
    ]
    return "".join(texts)
