"""What sensors make of the motion: bias, scale and delay per channel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter1d

from kemba.identify.evidence.problem import Theta
from kemba.identify.robot.motion.resampled import ResampledLog
from kemba.settings import BY_HAND, Settings, setting

Array = np.ndarray[Any, np.dtype[np.float64]]


class SensingSettings(Settings):
    """How late sensors read a motion."""

    calm: float = setting(
        2.0,
        "1",
        "nodes over which rates are smoothed before a delay reads them",
        f"{BY_HAND}; noise in the rate makes delays look shorter, by as much as a half",
    )


def travelled(rate: Array, h: Array) -> Array:
    """Way (n, L, m) of each coordinate since the start, by its rate and the steps h (n, L).

    Smoothed: noise in the rate that a delay is multiplied with makes delays look shorter than they
    are, by as much as a half.
    """
    calm: Array = gaussian_filter1d(rate, SensingSettings.current().calm, axis=0, mode="nearest")
    steps = 0.5 * (calm[1:] + calm[:-1]) * h[:-1, :, None]
    return np.concatenate([np.zeros_like(rate[:1]), np.cumsum(steps, axis=0)])


def sensed(
    channels: Sequence[str], resampled: Sequence[ResampledLog], y: Array, way: Array, theta: Theta
) -> Array:
    """Readings (n, L, m) of the true coordinates `y`, at theta; `way` (n, L, m) as `travelled`."""
    seen = y.copy()
    for i, channel in enumerate(channels):
        delay = theta.get(f"sensor_delay:{channel}.dt", 0.0)
        for j, track in enumerate(resampled if delay else ()):
            t, own = track.time, way[: len(track.time), j, i]
            seen[: len(t), j, i] += np.interp(t - delay, t, own) - own
        seen[..., i] *= 1.0 + theta.get(f"sensor_scale:{channel}.k", 0.0)
        seen[..., i] += theta.get(f"sensor_bias:{channel}.b", 0.0)
    return np.asarray(seen)


def ahead(values: Array, rates: Array, resampled: Sequence[ResampledLog], late: Array) -> Array:
    """Columns (n, L, k) as they are `late` (k,) seconds later: what late sensors will have seen;
    by their `rates` beyond the end of a run."""
    shifted = values.copy()
    for i in np.flatnonzero(late):
        for j, track in enumerate(resampled):
            t, n = track.time + late[i], len(track.time)
            beyond = np.maximum(t - track.time[-1], 0.0) * rates[n - 1, j, i]
            shifted[:n, j, i] = np.interp(t, track.time, values[:n, j, i]) + beyond
    return np.asarray(shifted)
