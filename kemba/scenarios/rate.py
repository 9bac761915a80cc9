"""How sure a rate of successes is."""

from __future__ import annotations


def wilson(successes: int, cases: int) -> tuple[float, float]:
    """The 95 % Wilson interval of a success rate."""
    from statsmodels.stats.proportion import proportion_confint

    low, high = proportion_confint(successes, cases, alpha=0.05, method="wilson")
    return float(low), float(high)
