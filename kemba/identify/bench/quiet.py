"""The noise of a rig's position sensor, told from parts of the logs in which the piston rests.

The position is what drives the prediction of the force, so that its noise is in no residual. Where
the piston rests, what a wide local cubic leaves over is noise alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d

from kemba.identify.bench.motion import MotionSettings, even_grid
from kemba.identify.logs.local_fit import local_fit
from kemba.identify.problem.noise import difference_sigma
from kemba.identify.problem.sensor_noise import (
    ChannelNoise,
    ColourSettings,
    Kind,
    chosen_noise,
    covariances,
    pairs,
    weighted,
)
from kemba.identify.problem.types import Array, Flags


class QuietSettings:
    """Where the piston rests, and what is believed of the noise there."""

    width = 135  # half width, in samples, of the cubic
    rest = 2e-3  # speed up to which the piston rests [m.s-1]
    # largest noise that is believed, in sigmas told from differences of rows: third differences
    # show a tenth of AR(1) noise of 0.98 per row
    most = 10.0


@dataclass(frozen=True)
class _Quiet:
    """One log on an even grid: what the cubic leaves (n,) in sigmas, where it rests, step [s]."""

    left: Array
    rest: Flags
    step: float


def position_noise(logs: Sequence[tuple[Array, Array]]) -> ChannelNoise:
    """Noise of the position sensor that all `logs` (times [s] and positions [m], both (n,)) share,
    in each log's `difference_sigma`; white where the piston rests too little to tell."""
    quiet = [found for time, x in logs if (found := _quiet(time, x)) is not None]
    settings = ColourSettings
    if sum(int(q.rest.sum()) for q in quiet) < settings.fewest:
        return ChannelNoise()
    n = max(len(q.left) for q in quiet)
    errors = np.full((n, len(quiet), 1), np.nan)
    for i, q in enumerate(quiet):
        errors[: len(q.left), i, 0] = np.where(q.rest, q.left, np.nan)
    step = float(np.median([q.step for q in quiet]))
    memories = (0.0, *settings.memories)
    columns = [_expected(memory, step) for memory in memories]
    counts = pairs(errors)
    measured = covariances(np.nan_to_num(errors)[..., None], errors, counts)
    kinds = [Kind(0, memory) for memory in memories]
    most = np.array([QuietSettings.most])
    a, b = weighted(columns, measured, counts)
    return chosen_noise(a, b, kinds, most, np.array([True]))[0]


def _quiet(time: Array, x: Array) -> _Quiet | None:
    """A log without its motion; None where it is too short."""
    settings = QuietSettings
    width = settings.width
    grid, values, step = even_grid(time, x)
    if len(grid) < 2 * width + 1:
        return None
    smooth, v = (local_fit(values, width, step, 3, k) for k in (0, 1))
    rest = maximum_filter1d(np.abs(v), 2 * width + 1) < settings.rest
    rest[:width] = rest[-width:] = False
    sigma = max(difference_sigma(x[np.isfinite(x)]), MotionSettings.finest)
    return _Quiet((values - smooth) / sigma, rest, step)


def _expected(memory: float, step: float) -> Array:
    """Autocovariances (1, lags) of what the cubic leaves of noise of unit sigma and this memory
    [s], on an even grid of this `step` [s]."""
    width, lags = QuietSettings.width, np.array(ColourSettings.lags)
    left = np.eye(1, 4 * width + 1, 2 * width)[0]
    left = left - local_fit(left, width, 1.0, 3)  # the filter's answer to one reading
    reach = np.convolve(left, left[::-1])
    apart = np.arange(len(reach)) - len(left) + 1
    noise = ChannelNoise(0.0, ((1.0, memory),)) if memory else ChannelNoise()
    found = [reach @ noise.covariance(step * (apart - lag)) for lag in lags]
    return np.array(found)[None, :]
