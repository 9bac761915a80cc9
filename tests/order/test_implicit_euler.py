"""The transcription is implicit Euler: first order on motions that are known."""

import math

import numpy as np
import pytest
from ocp.toys import Lag, Spring, bead, solve

END = 0.4  # s
OMEGA = 2 * math.pi
GRIDS = (40, 80, 160)


def exact(t: float) -> tuple[float, float, float]:
    """x, v and the lagging state of the oscillator released at 1 m."""
    x, v = math.cos(OMEGA * t), -OMEGA * math.sin(OMEGA * t)
    r = 10.0  # 1/s
    forced = r * (r * math.cos(OMEGA * t) + OMEGA * math.sin(OMEGA * t)) / (r**2 + OMEGA**2)
    return x, v, forced - r**2 / (r**2 + OMEGA**2) * math.exp(-r * t)


def end_errors(nodes: int) -> np.ndarray:
    program, point = solve(
        bead(),
        [Spring(), Lag()],
        {"body/x": 1.0, "body/vx": 0.0, "lag/w": 0.0},
        duration=END,
        nodes=nodes,
        step_variation=0.0,
        cost={},
    )
    assert program.times(point.Y)[-1] == pytest.approx(END)
    ends = [program.layout.full(point.Y, group)[-1, 0] for group in ("q", "v", "s")]
    return np.abs(np.array(ends) - exact(END))


def test_first_order_in_every_row() -> None:
    """Position, velocity and an effect's state: halving the step halves the error."""
    errors = np.array([end_errors(nodes) for nodes in GRIDS])
    orders = np.log2(errors[:-1] / errors[1:])
    assert orders == pytest.approx(1.0, abs=0.12)


def test_one_step_is_the_backward_one() -> None:
    """x1 = x0 + h v1 and v1 = v0 - h w^2 x1, solved by hand."""
    h = END / 4
    program, point = solve(
        bead(),
        [Spring()],
        {"body/x": 1.0, "body/vx": 0.0},
        duration=END,
        nodes=4,
        step_variation=0.0,
        cost={},
    )
    x, v = (program.layout.full(point.Y, group)[1, 0] for group in ("q", "v"))
    assert x == pytest.approx(1.0 / (1.0 + (h * OMEGA) ** 2))
    assert v == pytest.approx((x - 1.0) / h)
