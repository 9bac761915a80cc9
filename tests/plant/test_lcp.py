"""Complementarity problems, with those of contact in mind."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kemba.plant.kernel.jit import entry
from kemba.plant.kernel.lcp import NoSolutionError, by_lemke, solve_lcp
from kemba.plant.kernel.machine import Lcp, lcp_memory

seeds = st.integers(0, 2**32 - 1)


@entry
def solve_in(w: Lcp, n: int, pivoting: bool) -> None:
    if pivoting:
        by_lemke(w, n)
    else:
        solve_lcp(w, n)


def solve(A: np.ndarray, b: np.ndarray, guess: np.ndarray, pivoting: bool = False) -> Lcp:
    """The problem solved in memory that is larger than it."""
    n = len(b)
    w = lcp_memory(n + 2)
    w.A[:n, :n], w.b[:n], w.on[:n] = A, b, guess
    solve_in(w, n, pivoting)
    return w


def check(A: np.ndarray, b: np.ndarray, z: np.ndarray) -> None:
    w = A @ z + b
    size = 1e-8 * (1.0 + np.abs(A) @ np.abs(z) + np.abs(b))
    assert (z >= 0.0).all()
    assert (w >= -size).all()
    assert (np.abs(w * z) <= size * (1.0 + z)).all()


@settings(max_examples=60, deadline=None)
@given(seed=seeds, n=st.integers(1, 8))
def test_positive_definite_problems_are_solved_from_any_guess(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(n, n))
    A, b = root @ root.T + 0.1 * np.eye(n), rng.normal(size=n)
    found = solve(A, b, rng.random(n) < 0.5)
    check(A, b, found.z[:n])
    pivoted = solve(A, b, np.zeros(n, dtype=bool), pivoting=True)
    assert np.allclose(found.z[:n], pivoted.z[:n], atol=1e-7)
    assert not found.z[:n][~found.on[:n]].any()
    assert (pivoted.on[:n] == (pivoted.z[:n] > 0.0)).all()


@settings(max_examples=60, deadline=None)
@given(seed=seeds, mu=st.floats(0.0, 1.5), pivoting=st.booleans())
def test_contact_with_friction_is_always_solved(seed: int, mu: float, pivoting: bool) -> None:
    """Two feet: normal force, friction forward and backward, slip speed each."""
    rng = np.random.default_rng(seed)
    J = rng.normal(size=(4, 6))
    mobility = J @ np.diag(rng.uniform(1e-3, 1e-1, 6)) @ J.T
    split = np.zeros((6, 4))
    for foot in range(2):
        split[3 * foot, 2 * foot] = 1.0
        split[3 * foot + 1, 2 * foot + 1], split[3 * foot + 2, 2 * foot + 1] = 1.0, -1.0
    A, b = np.zeros((8, 8)), np.zeros(8)
    forces, slips = [0, 1, 2, 4, 5, 6], [3, 7]
    A[np.ix_(forces, forces)] = split @ mobility @ split.T
    b[forces] = split @ rng.normal(size=4)
    for foot, gamma in enumerate(slips):
        A[gamma, 4 * foot], A[gamma, 4 * foot + 1 : 4 * foot + 3] = mu, -1.0
        A[4 * foot + 1 : 4 * foot + 3, gamma] = 1.0
    check(A, b, solve(A, b, rng.random(8) < 0.5, pivoting).z[:8])


@pytest.mark.parametrize("short", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("first", [True, False])
def test_a_row_that_is_short_by_little_is_solved_too(short: float, first: bool) -> None:
    """With only the other force on, one row is short by `short` of its terms: its own force must
    come on. Solved by hand: z = (1 - s, s) and w = 0."""
    A = np.array([[1.0, 1.0], [1.0, 2.0]])
    b = -np.array([1.0, 1.0 + short])
    if not first:
        A, b = A[::-1, ::-1], b[::-1]
    guess = np.array([first, not first])
    found = solve(A, b, guess)
    z, active = found.z[:2], found.on[:2]
    assert z == pytest.approx([1.0 - short, short][:: 1 if first else -1], rel=1e-6)
    assert active.all()
    assert np.abs(A @ z + b).max() <= 1e-14


@pytest.mark.parametrize("short", [1e-3, 1e-6, 1e-9])
def test_a_force_that_pulls_by_little_is_let_go(short: float) -> None:
    """With both on, one force would pull by `short`: it must be off, and its row open."""
    A = np.array([[1.0, 1.0], [1.0, 2.0]])
    b = -np.array([1.0, 1.0 - short])
    found = solve(A, b, np.array([True, True]))
    z, active = found.z[:2], found.on[:2]
    assert z == pytest.approx([1.0, 0.0]) and active.tolist() == [True, False]
    assert A @ z + b == pytest.approx([0.0, short], abs=1e-15)


def test_a_problem_without_solution_says_so() -> None:
    with pytest.raises(NoSolutionError, match="no solution"):
        solve(np.array([[-1.0]]), np.array([-1.0]), np.array([False]))
