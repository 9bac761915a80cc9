"""A joint between nodes: cubics are met exactly, also behind an impact."""

import numpy as np

from kemba.ocp.controller import course
from kemba.trajectory import Trajectory

CLOCK = np.linspace(0.0, 0.03, 31)


def plan(q: np.ndarray, w: np.ndarray, phases: list[str]) -> Trajectory:
    t = np.array([0.0, 0.01, 0.03])
    meta = {"phases": phases} if phases else {}
    return Trajectory(t, {"hip/q [rad]": q, "hip/w [rad.s-1]": w}, meta)


def test_a_cubic_is_met_exactly() -> None:
    t = np.array([0.0, 0.01, 0.03])
    motion = plan(5 * t + 400 * t**3, 5 + 1200 * t**2, ["0-1 o 0", "1-2 o 1"])
    q, w = course(motion, "hip/q", "hip/w", CLOCK)
    np.testing.assert_allclose(q, 5 * CLOCK + 400 * CLOCK**3, atol=1e-12)
    np.testing.assert_allclose(w, 5 + 1200 * CLOCK**2, atol=1e-9)


def test_behind_an_impact_the_rate_is_that_after_it() -> None:
    """The rate jumps from 5 to -2 at the second node, which holds the one before."""
    late = np.maximum(CLOCK - 0.01, 0.0)
    q_after = 0.05 - 2 * 0.02 + 30 * 0.02**2
    motion = plan(np.array([0.0, 0.05, q_after]), np.array([5.0, 5.0, -2 + 60 * 0.02]),
                  ["0-1 o 0", "1-2 h 0"])  # fmt: skip
    q, w = course(motion, "hip/q", "hip/w", CLOCK)
    expected = np.where(CLOCK < 0.01, 5 * CLOCK, 0.05 - 2 * late + 30 * late**2)
    np.testing.assert_allclose(q, expected, atol=1e-12)
    assert w[5] == 5.0 and abs(w[-2] - (-2 + 60 * 0.019)) < 1e-9


def test_an_implicit_euler_plan_is_linear_in_between() -> None:
    motion = plan(np.array([0.0, 0.1, 0.0]), np.array([0.0, 10.0, -5.0]), [])
    q, w = course(motion, "hip/q", "hip/w", CLOCK)
    assert abs(q[5] - 0.05) < 1e-12 and abs(w[5] - 5.0) < 1e-12
