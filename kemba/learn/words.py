"""A round of learning in plain words."""

from __future__ import annotations

from collections.abc import Sequence

from kemba.errors import enumerated

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


def learnt(verdict: str, added: Sequence[str], before: float, after: float) -> str:
    """What the model lacks; `before`, `after`: errors of `compare`, in units of the noise."""
    if verdict not in LACKS or not added:
        return ELSE.get(verdict, "nothing was added to the model")
    them = "them" if len(added) > 1 else "it"
    falls = f"with {them} its error goes from {before:.2f} to {after:.2f} times the noise"
    return f"the model lacks {enumerated(added)}{LACKS[verdict]}; {falls}"


def expected(error: float | None) -> str:
    """What the next run should do; `error`: expected minus planned apex [m]."""
    if error is None:
        return ""
    side = "above" if error >= 0.0 else "below"
    return f"the next run is expected to reach {1e3 * abs(error):.1f} mm {side} its planned apex"


def refused(contradicted: Sequence[str], added: Sequence[str]) -> str:
    """Why the learnt model is not planned with; empty where it is."""
    if not contradicted:
        return ""
    them = "them" if len(added) > 1 else "it"
    return (
        f"but the model with {them} {' and '.join(contradicted)}: the plan is made with the model "
        "of the run, and its table is corrected"
    )


def sentences(parts: Sequence[str]) -> str:
    """Parts as sentences; empty ones are left out."""
    return " ".join(f"{part[:1].upper()}{part[1:].rstrip('.')}." for part in parts if part)
