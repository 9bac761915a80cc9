"""What sensors make of the motion along a robot log, channel by channel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.ndimage import gaussian_filter1d

from kemba.effects.sensors import SensorEffect, as_measured
from kemba.effects.series import Series
from kemba.identify.problem.types import Array
from kemba.identify.robot.batch import ResampledLog

# nodes over which rates are smoothed before a delay reads them: noise in the rate makes delays
# look shorter, by as much as a half
CALM = 2.0
# rows from which a late sensor's readings are moved to the rows to which they belong: calm
# rates tell 1 ms well and not 5 ms; of 618 blind cases one ranked a longer delay where none
# was, 1.53 ms
CAUGHT_UP = 1.5


def whole_rows(late: Array, row: float) -> Array:
    """By how many whole rows of `row` [s] the readings of sensors that are `late` (m,) [s] are
    moved; by none where calm rates do."""
    rows = np.rint(late / row)
    return np.where(np.abs(late) < CAUGHT_UP * row, 0.0, rows)


def travelled(rate: Array, h: Array) -> Array:
    """Way (n, L, m) of each coordinate since the start, by its rate and the steps h (n, L).

    The rates are smoothed first. A delay multiplies them, and noise in a regressor makes its
    coefficient too small: delays would look shorter than they are, by as much as a half.
    """
    calm: Array = gaussian_filter1d(rate, CALM, axis=0, mode="nearest")
    steps = 0.5 * (calm[1:] + calm[:-1]) * h[:-1, :, None]
    return np.concatenate([np.zeros_like(rate[:1]), np.cumsum(steps, axis=0)])


def sensed(
    faults: Mapping[str, Sequence[SensorEffect]],
    resampled: Sequence[ResampledLog],
    y: Array,
    way: Array,
) -> Array:
    """What sensors with these faults, by channel, show (n, L, m) of the true coordinates `y`.

    `way` (n, L, m) as `travelled` gives it: late sensors read the past from it.
    """
    seen = y.copy()
    for i, (channel, own) in enumerate(faults.items()):
        for j, log in enumerate(resampled):
            if not own and log.read is None:
                continue
            n, path = len(log.time), way[: len(log.time), j, i]
            read = log.time if log.read is None else log.read[:, i]
            then = y[:n, j, i] + np.interp(read, log.time, path) - path
            true = Series(log.time, then, path=path, read=read)
            seen[:n, j, i] = as_measured(own, channel, true).value
    return np.asarray(seen)


def ahead(values: Array, rates: Array, resampled: Sequence[ResampledLog], late: Array) -> Array:
    """Columns (n, L, k) as they are `late` (k,) seconds later: what late sensors will have seen;
    by their `rates` beyond the ends of a run."""
    shifted = values.copy()
    for i in np.flatnonzero(late):
        for j, log in enumerate(resampled):
            n = len(log.time)
            now = Series(log.time, values[:n, j, i], (rates[:n, j, i],))
            shifted[:n, j, i] = now.late(-late[i]).value
    return np.asarray(shifted)
