"""One channel over time, and what sensors can do to it: read it later, scale it, shift its zero."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[np.float64]]


@dataclass(frozen=True)
class Series:
    """A channel's `value` (n,) or (n, k) at `time` (n,) [s].

    `rates`: its first, second, ... derivative, each of the shape of `value`; they are changed along
    with it. `path`: the same channel up to a constant, but smoother; a shift in time is then read
    from the path, so that noise in `value` does not move with it.
    """

    time: Array
    value: Array
    rates: tuple[Array, ...] = ()
    path: Array | None = None
    read: Array | None = None

    def late(self, dt: float) -> Series:
        """The series as it was `dt` [s] earlier (dt < 0: as it will be later).

        Beyond an end it is extrapolated with its rate there; without a known rate it is constant.
        """
        if not dt:
            return self
        if self.path is not None:
            read = self.time if self.read is None else self.read
            before, now = (_at(self.time, self.path, at) for at in (read - dt, read))
            return replace(self, value=self.value + before - now)
        orders = (self.value, *self.rates)
        slopes = (*self.rates, np.zeros_like(self.value))
        value, *rates = (
            _at(self.time, order, self.time - dt, slope)
            for order, slope in zip(orders, slopes, strict=True)
        )
        return replace(self, value=value, rates=tuple(rates))

    def times(self, gain: float) -> Series:
        """The series times a constant."""
        path = None if self.path is None else gain * self.path
        rates = tuple(gain * rate for rate in self.rates)
        return replace(self, value=gain * self.value, rates=rates, path=path)

    def plus(self, offset: float) -> Series:
        """The series plus a constant."""
        return replace(self, value=self.value + offset)


def _at(time: Array, values: Array, times: Array, slope: Array | None = None) -> Array:
    """`values` (n,) or (n, k) at other times, linearly; beyond the ends with `slope` there."""
    columns = values.reshape(len(time), -1).T
    found = np.stack([np.interp(times, time, c) for c in columns], axis=1).reshape(values.shape)
    if slope is None:
        return np.asarray(found)
    before, after = np.minimum(times - time[0], 0.0), np.maximum(times - time[-1], 0.0)
    beyond = np.multiply.outer(before, slope[0]) + np.multiply.outer(after, slope[-1])
    return np.asarray(found + beyond)
