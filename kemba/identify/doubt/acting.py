"""What is left where effects act, however much is left elsewhere."""

from __future__ import annotations

import numpy as np

from kemba.identify.evidence.search import Search
from kemba.identify.evidence.spike_slab import NULL, Hypothesis


def excess_where_acting(
    search: Search, larger: Hypothesis, smaller: Hypothesis = NULL
) -> tuple[float, float]:
    """Squared error beyond the noise under the smaller hypothesis, and under the larger one.

    Aggregation windows count by the square of what the further effects change in them.
    """
    theta, further = search.points[larger].fit.theta, set(larger) - set(smaller)
    without = {n: value for n, value in theta.items() if n.rpartition(".")[0] not in further}
    thetas = (search.points[smaller].fit.theta, theta, without)
    columns = np.stack([search.problem.residual(each) for each in thetas], axis=1)
    before, after, lacking = search.base.division.windows.sums(columns).T
    weight = (lacking - after) ** 2
    return float(weight @ (before**2 - 1.0)), float(weight @ (after**2 - 1.0))
