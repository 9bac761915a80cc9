"""Sums over blocks of rows: about another point as if they were made there."""

import numpy as np

from kemba.identify.infer.linear import condense, moved
from kemba.identify.infer.windows import Windows


def test_sums_about_another_point_are_those_made_there() -> None:
    rng = np.random.default_rng(0)
    jacobian, blocks = rng.normal(size=(60, 3)), rng.permutation(np.repeat([0, 2, 5], 20))
    (here, there), mean, width = rng.normal(size=(2, 60)), np.zeros(3), np.ones(3)
    at = np.array([1.0, 2.0, 3.0])
    first = condense(("a", "b", "c"), mean, mean, width, jacobian, here, blocks)
    wanted = condense(("a", "b", "c"), at, mean, width, jacobian, there, blocks)
    found = moved(first, at, jacobian, there, blocks)
    for name in ("at", "gram", "slope", "power", "count"):
        np.testing.assert_allclose(getattr(found, name), getattr(wanted, name), err_msg=name)


def test_windows_sum_columns_side_by_side() -> None:
    columns, noise = np.arange(8.0).reshape(4, 2), np.array([2.0, 4.0])
    sums = Windows(np.array([0, 3]), noise).sums(columns)
    assert sums.tolist() == [[3.0, 4.5], [1.5, 1.75]]
