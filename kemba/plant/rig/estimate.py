"""Least squares with 95 % intervals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kemba.plant.stepping.arrays import Array


@dataclass(frozen=True)
class Estimate:
    """A value and its 95 % interval; the interval is NaN where the data are too few."""

    value: float
    low: float = float("nan")
    high: float = float("nan")

    def as_dict(self) -> dict[str, float]:
        """The figures as plain data for JSON."""
        return {"value": self.value, "low": self.low, "high": self.high}


def mean(values: Array) -> Estimate:
    """The mean of repeated values (n,)."""
    return linear(np.ones((len(values), 1)), np.asarray(values, dtype=float))[0][0]


def linear(X: Array, y: Array, read: Array | None = None) -> tuple[list[Estimate], float]:
    """Estimates of `read` @ coefficients (of the coefficients without it), and R2 of the fit.

    X (n, k), y (n,), read (m, k).
    """
    from scipy.stats import t

    beta, _, rank, _ = np.linalg.lstsq(X, y, rcond=None)
    rest, freedom = y - X @ beta, len(y) - int(rank)
    total = float(((y - y.mean()) ** 2).sum())
    r2 = 1.0 - float(rest @ rest) / total if total > 0.0 else float("nan")
    read = np.eye(X.shape[1]) if read is None else read
    values = read @ beta
    if freedom < 1:
        return [Estimate(float(value)) for value in values], r2
    covariance = np.linalg.pinv(X.T @ X) * float(rest @ rest) / freedom
    width = t.ppf(0.975, freedom) * np.sqrt(np.einsum("ij,jk,ik->i", read, covariance, read))
    bounds = zip(values, values - width, values + width, strict=True)
    return [Estimate(float(v), float(a), float(b)) for v, a, b in bounds], r2
