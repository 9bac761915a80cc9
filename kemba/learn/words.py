"""A round of learning in plain words."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from kemba.errors import enumerated
from kemba.identify.answer import Answer
from kemba.learn.expected import ExpectedApex

LACKS = {
    "partly": ", and something more that is not known",
    "missing": "",
}
ELSE = {
    "nothing": "the model lacks nothing that these logs show",
    "unknown": "the model lacks something that no effect of the catalogue explains",
    "bad-data": "the logs contradict themselves",
}


def jumped(error: float) -> str:
    """What the robot did; `error`: executed minus planned apex [m]."""
    side = "higher" if error >= 0.0 else "lower"
    return f"the robot jumped {1e3 * abs(error):.1f} mm {side} than planned"


def against(expected: ExpectedApex | None, executed: float) -> str:
    """Whether an executed apex [m] lay where it was expected; empty where nothing was."""
    if expected is None:
        return ""
    where = "inside" if expected.holds(executed) else "outside"
    return f": its apex of {executed:.4f} m lay {where} what was expected, {_band(expected)}"


def learnt(verdict: str, added: Sequence[str], before: float, after: float) -> str:
    """What the model lacks; `before`, `after`: errors on quoted logs, in units of the noise."""
    goes = f"its error goes from {before:.2f} to {after:.2f} times the noise"
    if not added:
        what = ELSE.get(verdict, "nothing was added to the model")
        return what if after >= before else f"{what}; with its figures fitted anew {goes}"
    them = "them" if len(added) > 1 else "it"
    if after >= before:
        return f"with {enumerated(added)} added {goes}: the model stays as it is"
    return f"the model lacks {enumerated(added)}{LACKS.get(verdict, '')}; with {them} {goes}"


def expected(band: ExpectedApex | None, planned: float | None) -> str:
    """What the next run should do; `planned`: its planned apex [m]."""
    if band is None or planned is None:
        return ""
    return (
        f"the next run is expected to reach {band.apex:.4f} m ({_band(band)}), planned are "
        f"{planned:.4f} m"
    )


def _band(band: ExpectedApex) -> str:
    return f"{band.low:.4f} to {band.high:.4f} m"


def few(logs: Sequence[Path]) -> tuple[str, ...]:
    """What a single log cannot tell."""
    if len(logs) > 1:
        return ()
    return ("there is one log only: how much executions scatter, and how well the model predicts a "
            "log that it was not fitted to, is not known",)  # fmt: skip


def effects(answer: Answer) -> dict[str, str]:
    """What an answer adds to the model, in words: effect -> its parameters."""
    return {
        r.effect: ", ".join(f"{name} = {value}" for name, value in r.parameters.items())
        for r in answer.ranking
        if r.effect in answer.added
    }


def sentences(parts: Sequence[str]) -> str:
    """Parts as sentences; empty ones are left out."""
    return " ".join(f"{part[:1].upper()}{part[1:].rstrip('.')}." for part in parts if part)
