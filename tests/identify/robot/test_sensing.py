"""What late sensors read of a motion that is known with noise only."""

from dataclasses import replace

import numpy as np
import pytest

from kemba.effects.sensors import SensorDelay
from kemba.identify.robot.batch import ResampledLog, ahead, sensed, travelled, whole_rows

TIME = np.arange(0.0, 0.6, 1e-3)
STEP = np.full((len(TIME), 1), 1e-3)
LATE = 2.4e-3  # s
FAULTS = {"body/z": [SensorDelay(channel="body/z", dt=LATE)]}


@pytest.fixture
def track() -> ResampledLog:
    """A run of which only the clock matters."""
    nothing = np.zeros((len(TIME), 1))
    unstated = (np.full(1, np.nan), np.zeros(1, dtype=bool))
    return ResampledLog("run", TIME, nothing, nothing, (), np.ones(1), *unstated)


def swing(t: np.ndarray) -> np.ndarray:
    return 0.1 * np.sin(12.0 * t)


def rate(t: np.ndarray) -> np.ndarray:
    return 1.2 * np.cos(12.0 * t)


def column(values: np.ndarray) -> np.ndarray:
    return values[:, None, None]


def test_a_late_sensor_reads_the_past(track: ResampledLog) -> None:
    way = travelled(column(rate(TIME)), STEP)
    seen = sensed(FAULTS, [track], column(swing(TIME)), way)[20:-20, 0, 0]
    assert seen == pytest.approx(swing(TIME - LATE)[20:-20], abs=2e-5)


def test_noise_in_the_rate_hardly_shortens_a_delay(track: ResampledLog) -> None:
    """Least squares for the delay, with a noisy rate as regressor, finds it within 8 %; with the
    rate as it is, a quarter is missing."""
    noise = 0.5 * np.random.default_rng(0).standard_normal(len(TIME))
    noisy = rate(TIME) + noise
    target = swing(TIME - LATE) - swing(TIME)
    way = travelled(column(noisy), STEP)
    change = sensed(FAULTS, [track], column(swing(TIME)), way)[:, 0, 0] - swing(TIME)
    calm = change / LATE
    assert target @ calm / (calm @ calm) == pytest.approx(LATE, rel=0.08)
    assert -target @ noisy / (noisy @ noisy) < 0.8 * LATE


def test_ahead_undoes_a_delay(track: ResampledLog) -> None:
    late = column(swing(TIME - LATE))
    found = ahead(late, column(rate(TIME - LATE)), [track], np.array([LATE]))
    assert found[:, 0, 0] == pytest.approx(swing(TIME), abs=5e-5)  # the last rows go by their rate


def test_readings_are_moved_by_whole_rows(track: ResampledLog) -> None:
    """2.4 rows late: read two rows earlier, the sensor is 0.4 rows late; a clock may jitter."""
    time = TIME + 2e-5 * np.random.default_rng(1).standard_normal(len(TIME))
    late = replace(track, time=time, y=swing(time - LATE)[:, None]).moved(np.array([2.0]))
    assert late.y[:-2, 0] == pytest.approx(swing(time[2:] - LATE))
    assert np.isnan(late.y[-2:]).all()
    way = travelled(column(rate(time)), np.diff(time, append=time[-1] + 1e-3)[:, None])
    seen = sensed(FAULTS, [late], column(swing(time)), way)[20:-20, 0, 0]
    assert seen == pytest.approx(late.y[20:-20, 0], abs=2e-5)


def test_a_sensor_that_is_not_late_after_all_is_read_at_its_own_times(track: ResampledLog) -> None:
    """Of readings that were moved for another hypothesis."""
    late = replace(track, y=swing(TIME)[:, None]).moved(np.array([2.0]))
    way = travelled(column(rate(TIME)), STEP)
    seen = sensed({"body/z": []}, [late], column(swing(TIME)), way)[20:-20, 0, 0]
    assert seen == pytest.approx(late.y[20:-20, 0], abs=2e-5)


def test_only_what_is_late_by_more_than_a_row_is_moved() -> None:
    late = np.array([0.0, 1.2e-3, 1.6e-3, -5.2e-3])
    assert whole_rows(late, 1e-3) == pytest.approx([0.0, 0.0, 2.0, -5.0])
