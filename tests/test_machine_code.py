"""Expressions as machine code give what CasADi's own machine gives, also row by row."""

import casadi as ca
import numpy as np
import pytest

from kemba.machine_code import Native, SampleMap


def test_rows_are_evaluated_one_by_one() -> None:
    x, p = ca.SX.sym("x", 3), ca.SX.sym("p", 2)
    first = ca.vertcat(ca.sin(x[0]) * p[0], ca.fmax(x[1], p[1]))
    second = ca.if_else(x[2] > 0, ca.sqrt(x[2]), -(x[2] ** 3))
    given = np.random.default_rng(1).standard_normal((7, 5))
    one, two = np.zeros((7, 2)), np.zeros((7, 1))
    Native([x, p], {"f": [first, second]}).rows("f", given, one, two)
    f = ca.Function("f", [ca.vertcat(x, p)], [first, second])
    for row, a, b in zip(given, one, two, strict=True):
        wanted = f(row)
        np.testing.assert_allclose(a, np.ravel(wanted[0].full()), rtol=1e-14)
        np.testing.assert_allclose(b, np.ravel(wanted[1].full()), rtol=1e-14)


def test_rows_that_feed_the_next_one_are_steps_in_time() -> None:
    s, h = ca.SX.sym("s"), ca.SX.sym("h")
    code = Native([s, h], {"step": [s * (1 - h), s]})
    x = np.column_stack([np.zeros(5), np.full(5, 0.1)])
    x[0, 0] = 2.0
    passed = np.zeros((4, 1))
    code.rows("step", x[:-1], x[1:, :1], passed)
    np.testing.assert_allclose(x[:, 0], 2.0 * 0.9 ** np.arange(5), rtol=1e-14)
    np.testing.assert_allclose(passed[:, 0], x[:-1, 0], rtol=1e-14)


def test_code_of_expressions_that_are_alike_is_made_once() -> None:
    def sums(factor: float) -> Native:
        x = ca.SX.sym("x", 2)
        return Native([x], {"f": [factor * x[0] + x[1]]})

    first, same, other = sums(2.0), sums(2.0), sums(3.0)
    assert first.address == same.address != other.address
    y = np.zeros((1, 1))
    other.rows("f", np.ones((1, 2)), y)
    assert y == 4.0


def test_rows_must_lie_in_one_piece() -> None:
    x = ca.SX.sym("x", 2)
    code = Native([x], {"f": [x[0] + x[1]]})
    with pytest.raises(ValueError, match="in one piece"):
        code.rows("f", np.zeros((2, 3)).T, np.zeros((3, 1)))


def test_a_map_over_samples_keeps_the_shapes() -> None:
    q, p = ca.SX.sym("q", 2), ca.SX.sym("p", 3)
    y = ca.vertcat(q[0] * p[0], ca.cos(q[1]), p[2])
    outputs = [y, ca.jacobian(y, q)]
    f = ca.Function("f", [q, p], outputs)
    samples, figures = np.random.default_rng(2).standard_normal((4, 2)), np.array([1.0, 2.0, 3.0])
    values, slopes = SampleMap([q, p], outputs)([samples], figures)
    assert values.shape == (4, 3) and slopes.shape == (4, 3, 2)
    for row, value, slope in zip(samples, values, slopes, strict=True):
        wanted = f(row, figures)
        np.testing.assert_allclose(value, np.ravel(wanted[0].full()), rtol=1e-14)
        np.testing.assert_allclose(slope, wanted[1].full(), rtol=1e-14)
