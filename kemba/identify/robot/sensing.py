"""What sensors make of the motion: bias, scale and delay per channel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from kemba.identify.problem import Theta
from kemba.identify.robot.track import Track

Array = np.ndarray[Any, np.dtype[np.float64]]


def sensed(
    channels: Sequence[str], tracks: Sequence[Track], y: Array, rate: Array, theta: Theta
) -> Array:
    """Readings (n, L, m) of the true coordinates `y` and their rates, at theta."""
    seen = y.copy()
    for i, channel in enumerate(channels):
        delay = theta.get(f"sensor_delay:{channel}.dt", 0.0)
        for j, track in enumerate(tracks if delay else ()):
            n, start = len(track.time), track.time[0]
            curve = CubicHermiteSpline(track.time, y[:n, j, i], rate[:n, j, i])
            seen[:n, j, i] = curve(np.maximum(track.time - delay, start))
        seen[..., i] *= 1.0 + theta.get(f"sensor_scale:{channel}.k", 0.0)
        seen[..., i] += theta.get(f"sensor_bias:{channel}.b", 0.0)
    return np.asarray(seen)
