"""Valve switching: dead time, merging, exact times."""

import numpy as np
import pytest

from kemba.effects.pneumatics.valve import ValveCloseDelay
from kemba.model import load_model
from kemba.plant.commands import Profile, acting
from kemba.plant.rigs import drive, locked


def pulses(profile: Profile) -> list[float]:
    return profile.times.tolist()


def test_switching_is_shifted_by_the_dead_time() -> None:
    late = acting(Profile.pulses((0.1, 0.2), (0.3, 0.4)), 0.006, 0.008)
    assert [late(t) for t in (0.105, 0.107, 0.207, 0.209, 0.31)] == [0, 1, 1, 0, 1]


def test_overlapping_pulses_merge_and_vanishing_ones_are_dropped() -> None:
    late = acting(Profile.pulses((0.100, 0.102), (0.104, 0.110)), 0.006, 0.010)
    assert pulses(late)[1:] == pytest.approx([0.106, 0.120])
    assert len(pulses(acting(Profile.pulses((0.1, 0.102)), 0.006, 0.004))) == 1


def test_a_valve_that_is_on_from_the_start_acts_from_the_start() -> None:
    on = Profile(np.array([0.0, 0.05]), np.array([1.0, 0.0]))
    late = acting(on, 0.006, 0.006)
    assert (late(0.0), late(0.055), late(0.057)) == (1.0, 1.0, 0.0)


@pytest.mark.parametrize("sent", [0.01, 0.0123456789])
def test_the_force_rises_exactly_the_dead_time_after_the_command(sent: float) -> None:
    rig = load_model("planning", extra=[ValveCloseDelay(dt=0.002)], rig=True)
    off = sent + 0.0317
    times = np.arange(0, 0.1, 0.001)
    valve = Profile(np.array([-1.0, sent, off]), np.array([0.0, 1.0, 0.0]))
    t = drive(rig, locked(0.0), {"valve/extend": valve}, times)
    rising, falling = np.clip(times - sent - 0.006, 0, off - sent + 0.002), times - off - 0.008
    top = 324.0 * (1 - np.exp(-rising / 0.008))
    expected = np.where(falling > 0, top[-1] * np.exp(-np.clip(falling, 0, None) / 0.013), top)
    assert np.abs(t["piston/F"] - expected).max() < 0.05
    assert np.array_equal(t["valve/extend"], (times >= sent - 1e-9) & (times < off - 1e-9))
