"""Equalities at one node: the dependent ones are left out, those that contradict are told."""

from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from kemba.ocp.phases.mode_constraints import ContradictionError, Independent

X, Y = ca.SX.sym("x"), ca.SX.sym("y")


def view() -> Any:
    """Two coordinates, neither rates nor states."""
    return SimpleNamespace(z=lambda groups: ca.vertcat(X, Y))


def equalities(x: float, y: float) -> Independent:
    """About the circle of radius one, at a guess that need not be on it."""
    found = Independent({"q": np.array([x, y]), "v": np.zeros(0), "s": np.zeros(0)})
    assert found.adds(X**2 + Y**2 - 1.0, view(), "the circle")
    return found


def test_what_follows_is_left_out_and_decided() -> None:
    found = equalities(1.0, 0.0)
    assert not found.adds(2.0 * (X**2 + Y**2) - 2.0, view(), "twice the circle")
    assert found.grants(X**2 + Y**2, view()) and not found.grants(Y, view())
    assert found.adds(Y - 0.1, view(), "a height"), "another direction"


def test_another_value_of_the_same_is_a_contradiction() -> None:
    found = equalities(1.0, 0.0)
    with pytest.raises(ContradictionError, match="excludes a larger circle"):
        found.adds(X**2 + Y**2 - 1.1, view(), "a larger circle")


def test_values_are_compared_where_the_others_hold() -> None:
    """At a guess far off the circle the same equality has another value than on it."""
    found = equalities(3.0, 4.0)
    assert not found.adds(ca.sqrt(X**2 + Y**2) - 1.0, view(), "the radius")
    with pytest.raises(ContradictionError):
        found.adds(ca.sqrt(X**2 + Y**2) - 5.0, view(), "the radius of the guess")


def test_a_rate_that_follows_from_others_is_no_condition_on_coordinates() -> None:
    """A point on a circle that is at rest: the rate of its radius has a slope by its place while it
    moves, and a third rate must not take the place of its height."""
    u, v = ca.SX.sym("u"), ca.SX.sym("v")
    moving: Any = SimpleNamespace(z=lambda groups: ca.vertcat(X, Y, u, v))
    guess = {"q": np.array([0.6, 0.8]), "v": np.array([0.1, 0.2]), "s": np.zeros(0)}
    found = Independent(guess)
    rows = {"circle": X**2 + Y**2 - 1.0, "its rate": 2 * X * u + 2 * Y * v, "rest": u}
    assert all(found.adds(row, moving, what) for what, row in rows.items())
    assert not found.adds(v, moving, "rest in height")
    assert found.adds(Y - 0.8, moving, "the height")
