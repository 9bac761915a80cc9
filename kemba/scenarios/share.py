"""How often a plan succeeds in scenarios."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.model import Model
from kemba.plant.certificate import rest_after
from kemba.plant.controller import execute_many
from kemba.scenarios.draw import Scenario, standing
from kemba.trajectory import Trajectory


def wilson(successes: int, cases: int) -> tuple[float, float]:
    """The 95 % Wilson interval of a success rate."""
    from scipy.stats import binomtest  # loads for as long as most plans take

    found = binomtest(successes, cases).proportion_ci(method="wilson")
    return float(found.low), float(found.high)


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
        own = {"n": self.n, "landed": self.landed, "wilson": list(self.wilson)}
        return {**own, "worst": self.worst, "apex_sigma_m": self.apex_sigma}

    @property
    def sentence(self) -> str:
        """The share in words."""
        low, high = (100 * end for end in self.wilson)
        return f"{self.landed} of {self.n} scenarios succeed (95 %: {low:.0f} to {high:.0f} %)"


@dataclass(frozen=True)
class ScenarioOutcome:
    """What a table does in one scenario: how far its apex [m] is from the plan's, and what goes
    wrong, "" where nothing does. The apex is -inf where the scenario cannot be simulated."""

    case: Scenario
    apex: float
    fault: str


def outcomes(
    model: Model, plan: Trajectory, table: Trajectory, cases: Sequence[Scenario]
) -> list[ScenarioOutcome]:
    """What the controller's table of a plan on `model` does in each scenario."""
    rest = rest_after(model, plan, table)
    asked = [
        {"model": c.model, "extra": rest, "start": standing(c.model, table, c.start)} for c in cases
    ]
    told = []
    for case, done in zip(cases, execute_many(table, asked), strict=True):
        if isinstance(done, KembaError):
            told.append(ScenarioOutcome(case, -np.inf, "cannot be simulated"))
            continue
        found = done.against(case.model, plan)
        told.append(ScenarioOutcome(case, found.apex_error_m, found.fault or ""))
    return told


def share_of(done: Sequence[ScenarioOutcome]) -> Share:
    """The share of scenarios that succeeded, and the worst of them."""
    good = sum(not one.fault for one in done)
    worst = max(done, key=lambda one: (bool(one.fault), abs(one.apex)))
    what = worst.fault or f"apex {1e3 * worst.apex:+.0f} mm"
    flown = [one.apex for one in done if np.isfinite(one.apex)]
    sigma = float(np.std(flown)) if flown else 0.0
    return Share(len(done), good, wilson(good, len(done)), f"{what}: {worst.case.sentence}", sigma)
