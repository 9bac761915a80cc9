"""Several runs side by side: arrays (n, L, .) padded at the end, and flat ones for functions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from kemba.identify.problem.types import Array, Flags
from kemba.identify.robot.motion.resampled import ResampledLog


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
