"""Sums over blocks of rows: about another point as if they were made there."""

import numpy as np
import pytest

from kemba.identify.infer.linear import condense, moved, precision_factor
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


def test_columns_that_are_nearly_alike_have_a_precision_whatever_is_rounded() -> None:
    rng = np.random.default_rng(0)
    column = 1e9 * rng.standard_normal((2000, 1))
    jacobian = column + 1e-2 * rng.standard_normal((2000, 30))
    factor = precision_factor(jacobian.T @ jacobian, np.ones(30))
    assert np.isfinite(factor).all()
    apart = rng.standard_normal((2000, 3))
    wanted = np.linalg.cholesky(4.0 * apart.T @ apart + np.eye(3))
    assert precision_factor(apart.T @ apart, np.full(3, 2.0)) == pytest.approx(wanted, rel=1e-12)
