"""What executions are expected to do: noise alone moves nothing, what is inferred is right."""

import numpy as np
import pytest

from kemba.policy.modes import WINDOW
from kemba.policy.write import Expected, expected_from
from kemba.trajectory import Trajectory

CLOCK = np.arange(60) * 1e-3
NOISE = {"x": 1e-3}


def executions(slope: float, count: int = 40) -> list[Trajectory]:
    """Motions that stand still until 30 ms and then go on at their own speeds; a force that is not
    measured is `slope` times as large as the speed."""
    rng = np.random.default_rng(3)
    found = []
    for speed in rng.normal(1.0, 0.3, count):
        moving = np.maximum(CLOCK - 0.03, 0.0)
        rate = speed * (moving > 0.0)
        columns = {"leg/x [m]": speed * moving, "leg/v [m.s-1]": rate, "leg/F [N]": slope * rate}
        found.append(Trajectory(CLOCK, columns))
    return found


def expected(noise: dict[str, float]) -> Expected:
    return expected_from(executions(50.0), CLOCK, ["leg/x"], ["leg/x", "leg/v", "leg/F"], noise)


def test_the_mean_is_what_deviations_are_counted_from() -> None:
    found = expected({})
    speeds = [motion["leg/v"][-1] for motion in executions(50.0)]
    assert found.mean.shape == (60, 1) and found.estimate.shape == (60, 3, 2)
    assert found.mean[-1, 0] == pytest.approx(np.mean(speeds) * 0.029)


def test_what_is_not_measured_is_inferred() -> None:
    """A leg that is 3 mm ahead after 29 ms is 0.103 m/s faster, and its force 5.2 N greater."""
    x, v, F = expected({}).estimate[-1] @ np.array([3e-3, 3e-3 / 0.029])
    assert (x, v, F) == pytest.approx((3e-3, 0.10345, 5.172), rel=1e-3)


def test_where_all_executions_agree_a_deviation_is_noise() -> None:
    assert np.abs(expected(NOISE).estimate[20]).max() < 1e-9


def test_noise_is_weighed_against_what_is_usual() -> None:
    """The rate over a window of 8 ms, with 1 mm of noise, says less than the place."""
    plain, noisy = expected({}).estimate[-1], expected(NOISE).estimate[-1]
    ahead = np.array([3e-3, 3e-3 / 0.029])
    assert 0.8 * (plain @ ahead)[1] < (noisy @ ahead)[1] < (plain @ ahead)[1]
    window, rng = WINDOW, np.random.default_rng(1)
    time = (np.arange(window) - (window - 1) / 2) * 1e-3
    values = rng.normal(0.0, 1e-3, (4000, window))
    measured = np.column_stack([values[:, -1], values @ time / (time @ time)])
    assert (measured @ noisy[1]).std() < 0.5 * (measured[:, 1]).std(), "m/s, from noise alone"
