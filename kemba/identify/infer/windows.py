"""Aggregation windows: residuals are summed over some rows before they are judged.

The error of a wrong model lasts longer than one row; noise changes from row to row.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from kemba.identify.problem.problem import Array, Labels, Problem, Rows, Texts, Theta

START = "start:"  # names of nuisance parameters that say how a log begins


@dataclass(frozen=True)
class Windows:
    """Groups of successive rows of one run, channel and condition.

    `first` (k,): first row of each window. `noise` (k,): 1 sigma of the sum over it, if there is
    nothing but noise.
    """

    first: Labels
    noise: Array

    def sums(self, columns: Array) -> Array:
        """Columns (n,) or (n, c) summed over every window, (k,) or (k, c), in units of noise."""
        count = len(columns)
        weights = 1.0 / np.repeat(self.noise, np.diff(self.first, append=count))
        sums = sparse.csr_array((weights, np.arange(count), np.append(self.first, count)))
        return np.asarray(sums @ columns)


def aggregation_windows(problem: Problem, rows: Rows, region: Texts) -> Windows:
    """Windows of `problem.window` rows, each under one condition."""
    begin = np.flatnonzero(changes(rows, region))
    place = np.arange(len(rows)) - np.repeat(begin, np.diff(np.append(begin, len(rows))))
    first = np.flatnonzero(place % problem.window == 0)
    return Windows(first, np.sqrt(np.add.reduceat(problem.expected_power(), first)))


def windows_of(problem: Problem) -> Windows:
    """Aggregation windows of a problem under all its conditions."""
    return aggregation_windows(problem, problem.rows(), problem.operating_point().regions())


def free_starts(
    problem: Problem, theta: Theta | None = None, also: Iterable[str] = ()
) -> dict[str, float]:
    """Theta with each log beginning as its own data say, found by one linear step.

    `also`: further nuisance parameters to find. All other values stay.
    """
    free = {n for n in problem.nuisance if n.startswith(START)} | set(also)
    found = {k: v for k, v in (theta or {}).items() if k not in free and not k.startswith(START)}
    names = [n for n in problem.nuisance if n in free]
    if not names:
        return found
    nominal, sigma = np.array([problem.nuisance[n] for n in names]).T
    j, r = problem.jacobian(found, names) * sigma, problem.residual(found)
    step = np.linalg.solve(j.T @ j + np.eye(len(names)), -j.T @ r)
    return found | dict(zip(names, (nominal + sigma * step).tolist(), strict=True))


def error_ratio(problem: Problem, theta: Theta | None = None, also: Iterable[str] = ()) -> float:
    """Error in units of the noise: the RMS of whitened residuals summed over aggregation windows.

    It is about 1 where the model at theta is right. Nothing is fitted to these logs but how each of
    them begins (and the nuisance parameters `also`): so it is the error of logs that a fit has not
    seen.
    """
    found = free_starts(problem, theta, also)
    return rms(windows_of(problem).sums(problem.residual(found)))


def changes(rows: Rows, region: Texts) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Rows (n,) whose run, channel or condition differs from that of the row before."""
    fresh = np.ones(len(rows), dtype=bool)
    labels = (rows.run, rows.channel, *(codes(x) for x in (rows.phase, rows.mode, region)))
    fresh[1:] = np.any([a[1:] != a[:-1] for a in labels], axis=0)
    return fresh


def codes(labels: np.ndarray[Any, Any]) -> Labels:
    """Labels (n,) as whole numbers (n,), the same number for the same label."""
    return np.asarray(np.unique(labels.astype(str), return_inverse=True)[1])


def rms(z: Array) -> float:
    """Root mean square of z (n,); NaN of nothing."""
    return float(np.sqrt(np.mean(z**2))) if len(z) else float("nan")


def excess(error: float) -> float:
    """The part of an error, in units of the noise, that noise does not make."""
    return float(np.sqrt(max(error**2 - 1.0, 0.0)))
