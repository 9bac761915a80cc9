"""What a round expects and what came of it, in words.

The table is simulated on the learnt model and on models that are drawn from its covariance; what
executions do beyond the model is added, and their scatter widens the band.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kemba.errors import KembaError, enumerated
from kemba.files import read_json
from kemba.identify.answer import Answer
from kemba.model import Model, load_spec
from kemba.plotting.source import Machine
from kemba.rounds.correction import flight_of
from kemba.runs import Run
from kemba.solve.truth import on_drawn_models
from kemba.trajectory import Trajectory

FEWEST = 10  # of them that must be simulated for a spread


@dataclass(frozen=True)
class ExpectedApex:
    """Apex [m] to expect of one execution, and the ends of its 95 % band."""

    apex: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.low:.4f} to {self.high:.4f} m"

    def holds(self, apex: float) -> bool:
        """Whether an executed apex lies inside."""
        return self.low <= apex <= self.high

    def json(self) -> dict[str, float]:
        """As plain data."""
        return {"apex_m": self.apex, "low_m": self.low, "high_m": self.high}

    @classmethod
    def of(cls, told: Any) -> ExpectedApex | None:
        """From plain data; None where it is none."""
        try:
            return cls(float(told["apex_m"]), float(told["low_m"]), float(told["high_m"]))
        except (KeyError, TypeError, ValueError):
            return None


def expected_of(run: Run) -> ExpectedApex | None:
    """What the round that made a run expected of it; None of a run that `learn` did not make."""
    file = run.path / "learning.json"
    told = read_json(file) if file.is_file() else None
    return ExpectedApex.of(told.get("next_expected")) if isinstance(told, dict) else None


def band_about(
    apex: float, table: Trajectory, model: Model, name: str, machine: Machine, rest: float,
    scatter: float,
) -> tuple[ExpectedApex, tuple[str, ...]]:  # fmt: skip
    """The band about an expected `apex` [m] of a table on `model`, built of the model YAML `name`,
    and a remark where its covariance cannot be had; `rest` [s] is simulated after the table,
    `scatter` [m] is 1 sigma between executions."""
    spread, remarks = 0.0, tuple[str, ...]()
    try:
        spread = _spread(table, model, name, machine, rest)
    except KembaError as error:
        remarks = (f"the expected band has no part of the model's own error: {error.what}",)
    reach = 1.96 * float(np.hypot(spread, scatter))
    return ExpectedApex(apex, apex - reach, apex + reach), remarks


def _spread(table: Trajectory, model: Model, name: str, machine: Machine, rest: float) -> float:
    """1 sigma [m] of the apex of models drawn from the covariance of `name`; 0 without one."""
    evidence = load_spec(name).evidence
    if evidence is None or evidence.covariance is None:
        return 0.0
    done = on_drawn_models(model, name, table, rest)
    apex = np.array([flight_of(run.trajectory, machine).apex for _, run in done])
    apex = apex[np.isfinite(apex)]
    return float(apex.std(ddof=1)) if len(apex) >= FEWEST else 0.0


LACKS = {"partly": ", and something more that is not known", "missing": ""}
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
    return f": its apex of {executed:.4f} m lay {where} what was expected, {expected}"


def learnt(verdict: str, added: Sequence[str], before: float, after: float) -> str:
    """What the model lacks; `before`, `after`: errors on quoted logs, in units of the noise."""
    goes = f"its error goes from {before:.2f} to {after:.2f} times the noise"
    if not added:
        what = ELSE.get(verdict, "nothing was added to the model")
        return (
            what
            if round(after, 2) >= round(before, 2)
            else f"{what}; with its figures fitted anew {goes}"
        )
    them = "them" if len(added) > 1 else "it"
    if after >= before:
        return f"with {enumerated(added)} added {goes}: the model stays as it is"
    return f"the model lacks {enumerated(added)}{LACKS.get(verdict, '')}; with {them} {goes}"


def expected(band: ExpectedApex | None, planned: float | None) -> str:
    """What the next run should do; `planned`: its planned apex [m]."""
    if band is None or planned is None:
        return ""
    return (
        f"the next run is expected to reach {band.apex:.4f} m ({band}), planned are {planned:.4f} m"
    )


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
