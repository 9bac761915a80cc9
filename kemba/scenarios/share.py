"""How often a plan succeeds in scenarios."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.model import Model
from kemba.plant.execution.certificate import rest_after
from kemba.plant.execution.controller import execute_many
from kemba.plant.execution.replay import LandingSettings, Replay, ends_standing
from kemba.scenarios.conditions import standing
from kemba.scenarios.draw import Scenario
from kemba.scenarios.rate import wilson
from kemba.trajectory import Trajectory


@dataclass(frozen=True)
class Share:
    """In how many of `n` scenarios a plan succeeds: a landing is kept, or a flight stays upright.

    `worst` names the worst scenario and what happens in it. `apex_sigma` [m]: spread of the apex.
    """

    n: int
    landed: int
    wilson: tuple[float, float]
    worst: str
    apex_sigma: float

    def summary(self) -> dict[str, Any]:
        """The entry `robust` of the certificate."""
        return {
            "n": self.n,
            "landed": self.landed,
            "wilson": list(self.wilson),
            "worst": self.worst,
            "apex_sigma_m": self.apex_sigma,
        }

    @property
    def sentence(self) -> str:
        """The share in words."""
        low, high = (100 * end for end in self.wilson)
        return f"{self.landed} of {self.n} scenarios succeed (95 %: {low:.0f} to {high:.0f} %)"


def share(
    model: Model,
    plan: Trajectory,
    table: Trajectory,
    cases: Sequence[Scenario],
    jobs: int | None = None,
) -> Share:
    """The share of scenarios in which the controller's table of a plan on `model` succeeds."""
    rest = rest_after(model, plan, table)
    asked = [
        {"model": c.model, "extra": rest, "start": standing(c.model, table, c.start)} for c in cases
    ]
    lands = bool(ends_standing(model, plan))
    apexes, faults = [], []
    for case, done in zip(cases, execute_many(table, asked, jobs), strict=True):
        if isinstance(done, KembaError):
            apexes.append(-np.inf)
            faults.append("cannot be simulated")
            continue
        found = done.against(case.model, plan)
        apexes.append(found.apex_error_m)
        faults.append(fault_of(found, lands))
    good = sum(not fault for fault in faults)
    errors = np.array(apexes)
    rank = [(bool(fault), abs(error)) for fault, error in zip(faults, apexes, strict=True)]
    worst = max(range(len(cases)), key=lambda i: rank[i])
    what = faults[worst] or f"apex {1e3 * apexes[worst]:+.0f} mm"
    told = f"{what}: {cases[worst].sentence}"
    flown = errors[np.isfinite(errors)]
    sigma = float(np.std(flown)) if len(flown) else 0.0
    return Share(len(cases), good, wilson(good, len(cases)), told, sigma)


def fault_of(found: Replay, lands: bool) -> str:
    """What goes wrong in an execution; "" where nothing does. `lands`: whether the plan lands."""
    if lands:
        return found.fault or ""
    turned = np.abs(found.trajectory["body/pitch"]).max() > LandingSettings.current().upright
    return "tips over" if turned else ""
