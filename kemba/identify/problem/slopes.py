"""Residuals where little can be predicted, and their finite differences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kemba.identify.problem.types import Array


class StepSettings:
    """Steps of finite differences."""

    nuisance = 0.5  # step of a nominal figure, in prior sigmas
    parameter = 0.05  # step of a parameter that is on, as a share of its size or value
    absurd = 1e5  # residual in sigmas at which nothing can be predicted: beyond data


def bounded(residual: Array, absurd: float) -> Array:
    """Residuals held within `absurd` sigmas; those that are no numbers are as large as that."""
    return np.asarray(np.clip(np.nan_to_num(residual, nan=absurd), -absurd, absurd))


def mean_slope(base: Array, there: Sequence[Array], steps: Sequence[float]) -> Array:
    """Mean slope, shaped as the residuals `base`, of finite `steps` that lead to the residuals
    `there`; zero where every step leads to where nothing can be predicted: a rod that is driven
    through its cylinder's end leaves no volume to the air."""
    absurd = StepSettings.absurd
    known = [i for i, r in enumerate(there) if np.all(np.abs(r) < absurd)]
    if not known:
        return np.zeros_like(base)
    return np.asarray(np.mean([(there[i] - base) / steps[i] for i in known], axis=0))
