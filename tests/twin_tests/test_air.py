"""The blind twin's chambers and valves."""

import numpy as np
import pytest

pytest.importorskip("numba")

from twin import (
    air,
    bench,
    catalogue,
    figures,
    rigs,
    valves,
)
from twin.catalogue import hidden
from twin.scripts import clock


def air_rates(effects, state, u=(1.0, 0.0), x=0.02):
    leg, _, _ = catalogue.tables(effects)
    out = np.zeros(6)
    demand = air.air_rates(
        x, 0.0, *u, np.array(state), 0.9, figures.Robot().air[0], leg[0], False, out
    )
    return out, demand


def test_air_effects_are_their_equations():
    state = [200.0, 50.0, 0.3, 0.1, 0.0, 0.0]
    plain, demand = air_rates([], state)
    tau = 0.008 + 2.0 / 7.0 * 0.017
    assert plain[0] == pytest.approx((0.9 * 324.0 - 200.0) / tau)
    assert demand == pytest.approx((0.9 - 200.0 / 324.0) / tau)
    leaking, _ = air_rates([hidden("cross_leak")], state)
    gap = 3.0 * (200.0 / figures.AREA_E - 50.0 / figures.AREA_R)
    change = leaking[:2] - plain[:2]
    assert np.allclose(change, [-gap * figures.AREA_E, gap * figures.AREA_R])
    slower, _ = air_rates([hidden("rise_time_scale")], state)
    assert np.allclose(slower[:2], plain[:2] / 1.25)
    more, _ = air_rates([hidden("supply_scale")], state)
    assert more[0] - plain[0] == pytest.approx(0.1 * 0.9 * 324.0 / tau)
    lagged, _ = air_rates([hidden("hose_lag")], state)
    assert lagged[2] == pytest.approx((1.0 - 0.3) / 0.004)
    filtered, _ = air_rates([], state, u=(0.3, 0.1))
    assert np.allclose(lagged[:2], filtered[:2])


def test_locked_step_follows_table_one():
    ticks = clock(0.2)
    sent = np.zeros((ticks.size, 2))
    sent[10:, 0] = 1.0
    still = np.zeros(ticks.size)
    truth = bench.simulate(rigs.Rig("step", ticks, still, still, sent))
    after = truth.times - 0.016
    expected = np.where(after > 0, 324.0 * (1.0 - np.exp(-np.maximum(after, 0.0) / 0.008)), 0.0)
    assert np.allclose(truth.force, expected, atol=1e-3)


def test_orifice_chamber_is_like_the_table_but_not_it():
    ticks = clock(0.3)
    sent = np.zeros((ticks.size, 2))
    sent[:150, 0] = 1.0
    for x, rise, vent in ((0.0, 0.008, 0.013), (0.07, 0.025, 0.037)):
        still = np.full(ticks.size, x)
        rig = rigs.Rig("step", ticks, still, np.zeros(ticks.size), sent)
        truth = bench.simulate(rig, chambers="orifice")
        full = truth.force.max()
        assert full == pytest.approx(324.0, rel=0.01)
        up = truth.times[np.argmax(truth.force > 0.632 * full)] - 0.006
        down = truth.times[truth.times > 0.15][
            np.argmax(truth.force[truth.times > 0.15] < 0.368 * full)
        ] - 0.156  # fmt: skip
        assert up == pytest.approx(rise, rel=0.25)
        assert down == pytest.approx(vent, rel=0.25)
    assert air.thin_plate(2e5, 2e5) == 0.0


def test_late_valves_merge_pulses():
    pulses = [(0.0, 0.010), (0.013, 0.020), (0.05, np.inf)]
    assert valves.shifted(pulses, 0.006, 0.010) == [(0.006, 0.030), (0.056, np.inf)]
    early = valves.shifted([(0.0, 0.004)], 0.006, 0.001)
    assert early == []  # closing so early swallows the pulse
