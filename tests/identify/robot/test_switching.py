"""Late valves are the same to simulator, bench and robot identification."""

import numpy as np
import pytest

from kemba.effects.pneumatics.switching import changes, delayed, instants, is_on, pulses
from kemba.identify.robot.batch import ResampledLog
from kemba.identify.robot.state import substeps
from kemba.plant.commands import Profile, acting

TIME = np.arange(400) / 1e3
UNSTATED = (np.full(1, np.nan), np.zeros(1, dtype=bool))  # of the noise


def command(seed: int) -> np.ndarray:
    """Random pulses (n,) of 2 to 30 ms; some begin or end with the valve on."""
    rng = np.random.default_rng(seed)
    on, column = bool(rng.integers(2)), np.zeros(len(TIME))
    at = 0
    while at < len(TIME):
        width = int(rng.integers(2, 30))
        column[at : at + width] = on
        at, on = at + width, not on
    return column


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("late", [(0.006, 0.006), (0.006, 0.019), (0.021, 0.006)])
def test_every_reader_switches_alike(seed: int, late: tuple[float, float]) -> None:
    column = command(seed)
    sent = pulses(TIME, column)
    commands = column[:, None]
    log = ResampledLog("run", TIME, commands, commands, (sent,), np.ones(1), *UNSTATED)
    times, valves, at = substeps(log, np.array([late]))
    assert np.array_equal(times[at], TIME)
    middle = 0.5 * (times[1:] + times[:-1])
    simulated = acting(Profile(TIME, column), *late)
    long = np.diff(times) > 1e-9
    assert np.array_equal(valves[0][long], is_on(delayed(sent, *late), middle)[long])
    assert valves[0][long].tolist() == [simulated(t) for t in middle[long]]
    assert np.isin(np.clip(instants(delayed(sent, *late)), 0.0, TIME[-1]), times).all()


def test_changes_say_when_and_which_way() -> None:
    times, signs = changes([(-np.inf, 0.1), (0.2, 0.3), (0.4, np.inf)])
    assert times.tolist() == [0.1, 0.2, 0.3, 0.4]
    assert signs.tolist() == [-1.0, 1.0, -1.0, 1.0]
