"""How far an estimate may be off: blocks of rows that scatter more than rows do, and runs that
disagree.

What a model lacks is no white noise: it lasts. So intervals come from blocks of time ("sandwich"),
of several lengths, as long as the motion or shorter; the widest one counts. Errors that a repeated
motion repeats cancel within a block as long as a repeat, so that one length can be blind.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.special import stdtrit

from kemba.identify.evidence.linear import time_blocks
from kemba.identify.problem.problem import Array, Labels, Problem
from kemba.identify.tails import chi2_above

BLOCKS = (12, 24, 48)  # of time, at least; with fewer than 12 the scatter itself is not known
DISAGREE = 0.01  # p-value from which runs disagree
TELLS = 0.1  # share of the best run's information from which a run is asked
OF_A_RUN = 6  # blocks of a run, at least, from which its own scatter is told


def divisions(problem: Problem) -> list[Labels]:
    """Labels (n,) of the rows in blocks of time, and in stretches of a way that is gone to and fro,
    each with two directions: what a model lacks at one place it lacks in every repeat."""
    found = [time_blocks(problem, wanted=count) for count in BLOCKS]
    if (way := problem.way()) is not None:
        place, forward = way
        for count in BLOCKS:
            edges = np.linspace(place.min(), place.max(), count + 1)[1:-1]
            found.append(2 * np.searchsorted(edges, place) + forward)
    return found


def half_widths(labels: Labels, j: Array, r: Array, h: Array) -> Array:
    """Half the 95 % interval (k,) of each parameter, from the scatter of blocks of rows.

    `labels` (n,) of the blocks; `j` (n, k) and `r` (n,): slopes and residual of the fit; `h`
    (k, k): inverse of j'j, priors included.
    """
    pieces = np.stack([j[labels == b].T @ r[labels == b] for b in np.unique(labels)])
    freedom = max(len(pieces) - 1, 1)
    covariance = h @ (pieces.T @ pieces) @ h * len(pieces) / freedom
    return np.asarray(np.sqrt(np.diag(covariance)) * stdtrit(freedom, 0.975))


def apart_between_runs(
    problem: Problem, j: Array, r: Array
) -> Iterator[tuple[int, tuple[float, float]]]:
    """Parameters on which runs disagree, and how far from the fit what they say begins and ends.

    `j` (n, k), `r` (n,) as above. A run's own value is told with all others as they are fitted, its
    error by the scatter of its blocks.
    """
    run, count = problem.rows().run, len(problem.runs)
    if count < 2:
        return
    blocks = time_blocks(problem, wanted=OF_A_RUN * count)
    owner = run[np.unique(blocks, return_index=True)[1]]
    for i in range(j.shape[1]):
        power = np.bincount(run, j[:, i] ** 2, count)
        pieces = np.bincount(blocks, j[:, i] * r)
        asked = power > TELLS * power.max()
        scatter = [len(own) * np.var(own, ddof=1) for k in range(count)
                   if len(own := pieces[owner == k]) > 1]  # fmt: skip
        if asked.sum() < 2 or len(scatter) < count:
            continue
        step = -np.bincount(owner, pieces, count)[asked] / power[asked]
        error = np.sqrt(np.maximum(scatter, power)[asked]) / power[asked]
        weight = error**-2.0
        mean = float(weight @ step / weight.sum())
        if chi2_above(float(weight @ (step - mean) ** 2), int(asked.sum()) - 1) < DISAGREE:
            yield i, (float(step.min()), float(step.max()))
