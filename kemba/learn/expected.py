"""The apex to expect of a table: its middle and its 95 % band.

The table is simulated on the learnt model and on models that are drawn from its covariance; what
executions do beyond the model is added, and their scatter widens the band.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.files import read_json
from kemba.learn.flight import flight_of
from kemba.model import Model, load_spec
from kemba.plotting.robot.machine import Machine
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
