"""Robot logs as the fit reads them: nodes about a millisecond apart, several runs side by side; and
what sensors make of the motion along them.

Arrays (n, L, .) have the run as their second axis and are padded at the end; functions take flat
ones.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter1d

from kemba.effects.pneumatics.switching import Pulse, pulses
from kemba.effects.sensors import CHANNELS, SensorEffect, as_measured
from kemba.effects.series import Series
from kemba.identify.logs.reading import held
from kemba.identify.problem.noise import FEWEST_VALUES, difference_sigma
from kemba.identify.problem.problem import Array, Flags
from kemba.trajectory import Trajectory

LONGEST = 1.6e-3  # nodes farther apart are filled [s]
# smallest noise of a channel, in m or rad: far below what position sensors resolve
FINEST = 1e-6


@dataclass(frozen=True)
class ResampledLog:
    """One run: `time` (n,) of the nodes, `y` (n, m) with NaN where nothing was measured,
    `torque` (n, legs) held from each node, the pulses `sent` to each valve, `sigma` (m,) of one
    value of `y`. `memory` (m,): correlation time [s] of the noise as the sidecar states it, NaN
    where it does not; `stated` (m,): whether the sidecar states its sigma. `read` (n, m): when each
    value of `y` was read [s], where that is not at its node."""

    name: str
    time: Array
    y: Array
    torque: Array
    sent: tuple[list[Pulse], ...]
    sigma: Array
    memory: Array
    stated: np.ndarray[Any, np.dtype[np.bool_]]
    read: Array | None = None

    def moved(self, rows: Array) -> ResampledLog:
        """The same run with the readings of each channel so many `rows` (m,) earlier, where their
        sensor saw them; noise stays as white as it was."""
        n = len(self.time)
        places = np.arange(n)[:, None] + rows.astype(int)
        within, at = (places >= 0) & (places < n), np.clip(places, 0, n - 1)
        y = np.where(within, np.take_along_axis(self.y, at, axis=0), np.nan)
        return replace(self, y=y, read=self.time[at])


def resample(
    log: Trajectory, channels: Sequence[str], legs: Sequence[str], name: str
) -> ResampledLog:
    """The nodes of a log."""
    keep = np.isfinite(log.time)
    time = log.time[keep]
    raw = np.stack([log[c][keep] for c in channels], axis=1)
    torque = np.stack([held(log[f"{leg}/hip/tau"][keep]) for leg in legs], axis=1)
    valves = [f"{leg}/valve/{side}" for leg in legs for side in ("extend", "retract")]
    sent = tuple(pulses(time, held(log[v][keep])) for v in valves)
    noise, times = (log.meta.get(key) or {} for key in ("noise", "noise_time"))
    known = [noise.get(c, noise.get(f"{c} [{log.unit(c)}]")) for c in channels]
    values = zip(channels, known, raw.T, strict=True)
    sigma = np.array([_sigma(c, y) if k is None else float(k) for c, k, y in values])
    memory = np.array([times.get(c, np.nan) for c in channels])
    stated = np.array([k is not None for k in known])
    time, raw, torque = _fill(time, raw, torque)
    return ResampledLog(name, time, raw, torque, sent, sigma, memory, stated)


def _sigma(channel: str, values: Array) -> float:
    """Noise of one sample as its values tell, else the usual one."""
    if np.isfinite(values).sum() < FEWEST_VALUES:
        return CHANNELS[channel.split("/")[-1]][1]
    return max(difference_sigma(values), FINEST)


def _fill(time: Array, raw: Array, torque: Array) -> tuple[Array, Array, Array]:
    """Nodes without measurement where rows are far apart."""
    pieces = np.maximum(1, np.ceil(np.diff(time) / LONGEST)).astype(int)
    if (pieces == 1).all():
        return time, raw, torque
    start = np.repeat(np.arange(len(pieces)), pieces)
    inside = np.arange(len(start)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    step = np.diff(time) / pieces
    times = np.append(time[start] + inside * step[start], time[-1])
    filled = np.vstack([np.where((inside == 0)[:, None], raw[start], np.nan), raw[-1:]])
    return times, filled, np.vstack([torque[start], torque[-1:]])


@dataclass(frozen=True)
class Batch:
    """`resampled` as arrays whose second axis is the run; steps past a run's end stand still.

    `source`: the runs as they were recorded, where late readings stand at earlier nodes here.
    """

    resampled: tuple[ResampledLog, ...]
    source: Batch | None = None

    def moved(self, rows: Array) -> Batch:
        """The recorded runs with the readings of each channel so many `rows` (m,) earlier."""
        recorded = self.source or self
        if not rows.any():
            return recorded
        return Batch(tuple(log.moved(rows) for log in recorded.resampled), recorded)

    @cached_property
    def n(self) -> int:
        return max(len(t.time) for t in self.resampled)

    @cached_property
    def valid(self) -> Flags:
        """(n, L): is this a node of the run?"""
        return np.arange(self.n)[:, None] < [len(t.time) for t in self.resampled]

    @cached_property
    def h(self) -> Array:
        """(n, L): seconds from each node to the next, 1 ms where there is none."""
        steps = [np.append(np.diff(t.time), 1e-3) for t in self.resampled]
        return self.pad(steps, 1e-3)

    @cached_property
    def time(self) -> Array:
        """(n, L): times of the nodes [s], zero past a run's end."""
        return self.pad([t.time for t in self.resampled], 0.0)

    @cached_property
    def y(self) -> Array:
        """(n, L, m): readings, NaN past a run's end."""
        return self.pad([t.y for t in self.resampled], np.nan)

    @cached_property
    def torque(self) -> Array:
        """(n, L, legs): hip torques [N.m], zero past a run's end."""
        return self.pad([t.torque for t in self.resampled], 0.0)

    @cached_property
    def sigma(self) -> Array:
        """(L, m): noise of one node's value."""
        return np.stack([t.sigma for t in self.resampled])

    @cached_property
    def memory(self) -> Array:
        """(m,): stated correlation time [s] of each channel's noise, NaN where none is stated."""
        memories = np.stack([t.memory for t in self.resampled])
        known = np.isfinite(memories).any(axis=0)
        return np.where(known, np.nan_to_num(memories).max(axis=0), np.nan)

    @cached_property
    def stated(self) -> Flags:
        """(m,): whether the noise of a channel is stated for every run."""
        found: Flags = np.all([t.stated for t in self.resampled], axis=0)
        return found

    def pad(self, parts: Sequence[Array], value: float) -> Array:
        """(n, L, .) of one array (n_l, .) per run."""
        whole = np.full((self.n, len(parts), *parts[0].shape[1:]), value)
        for i, part in enumerate(parts):
            whole[: len(part), i] = part
        return whole

    def flat(self, values: Array) -> Array:
        """(n, L, .) -> (N, .): the nodes that are."""
        return np.asarray(values[self.valid])

    def deep(self, values: Array, fill: float = 0.0) -> Array:
        """(N, .) -> (n, L, .)."""
        whole = np.full((*self.valid.shape, *values.shape[1:]), fill)
        whole[self.valid] = values
        return whole


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
