"""Residuals summed over moments: a model that is wrong errs for longer than a sample, noise not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from kemba.identify.evidence.operating_point import region_labels
from kemba.identify.evidence.problem import Array, Labels, Problem, Rows


@dataclass(frozen=True)
class Windows:
    """Stretches of successive rows of one run, channel and condition: the first row (k,) of each,
    and the size (k,) that noise would give to the sum over it."""

    first: Labels
    noise: Array

    def sums(self, columns: Array) -> Array:
        """Columns (n, ...) summed over every grain, (k, ...), in units of noise."""
        scale = self.noise.reshape(-1, *[1] * (columns.ndim - 1))
        return np.asarray(np.add.reduceat(columns, self.first, axis=0) / scale)


def aggregation_windows(problem: Problem, rows: Rows, region: Labels) -> Windows:
    """Grains of as many rows as the problem says (`window`, else one), each under one condition."""
    begin = np.flatnonzero(changes(rows, region))
    place = np.arange(len(rows)) - np.repeat(begin, np.diff(np.append(begin, len(rows))))
    first = np.flatnonzero(place % getattr(problem, "window", 1) == 0)
    return Windows(first, np.sqrt(np.add.reduceat(expected(problem, len(rows)), first)))


def windows_of(problem: Problem) -> Windows:
    """Grains of a problem by all its conditions."""
    rows = problem.rows()
    return aggregation_windows(problem, rows, region_labels(problem, rows)[1])


def expected(problem: Problem, count: int) -> Array:
    """Mean square (n,) of each row if the model were right: one, or what the problem knows."""
    known = getattr(problem, "expected_power", None)
    return np.asarray(known() if known else np.ones(count))


def changes(rows: Rows, region: Labels) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Rows (n,) whose run, channel or condition differs from that of the row before."""
    fresh = np.ones(len(rows), dtype=bool)
    labels = (rows.run, rows.channel, *(codes(x) for x in (rows.phase, rows.mode, region)))
    fresh[1:] = np.any([a[1:] != a[:-1] for a in labels], axis=0)
    return fresh


def codes(labels: np.ndarray[Any, Any]) -> Labels:
    """Labels as whole numbers."""
    return np.asarray(np.unique(labels.astype(str), return_inverse=True)[1])


def rms(z: Array) -> float:
    """Root mean square; NaN of nothing."""
    return float(np.sqrt(np.mean(z**2))) if len(z) else float("nan")
