"""controller.csv: 1 kHz, hips interpolated, valves switched the dead time early."""

from __future__ import annotations

import numpy as np
import pytest
from ocp.runs import QUICK, Solved, solved

from kemba.effects import Effect
from kemba.effects.pneumatics.timing import ValveCloseDelay
from kemba.model import load_model
from kemba.ocp import controller_table
from kemba.trajectory import Trajectory

LEAD = 0.006  # s
VALVES = [f"{leg}/valve/{c}" for leg in ("front", "rear") for c in ("extend", "retract")]


@pytest.fixture(params=QUICK)
def run(request: pytest.FixtureRequest) -> Solved:
    return solved(request.param)


def switches(time: np.ndarray, values: np.ndarray) -> list[tuple[float, float]]:
    """(time, new value) of every change, from closed."""
    before = np.concatenate([[0.0], values[:-1]])
    return [(float(time[i]), float(values[i])) for i in np.flatnonzero(values != before)]


def test_one_row_a_millisecond(run: Solved) -> None:
    table, plan = run.run.controller, run.plan
    assert np.diff(table.time) == pytest.approx(0.001)
    assert table.time[0] == 0.0
    assert 0.0 <= table.time[-1] - LEAD - plan.time[-1] < 0.001
    assert table.meta == {"kind": "controller", "lead": LEAD}


def test_valves_are_sent_the_dead_time_early(run: Solved) -> None:
    """What acts on (t[k-1], t[k]] stands at node k; it is sent 6 ms before t[k-1]. The table's
    own time runs the lead ahead of the plan's, so a switch at plan time t stands in row t."""
    table, plan = run.run.controller, run.plan
    for name in VALVES:
        assert set(table[name]) <= {0.0, 1.0}
        starts = np.concatenate([[plan.time[0]], plan.time[:-1]])
        planned = switches(starts[1:], plan[name][1:])
        sent = [(time - LEAD, value) for time, value in switches(table.time, table[name])]
        assert [value for _, value in sent] == [value for _, value in planned]
        early = [begin - LEAD - time for (time, _), (begin, _) in zip(sent, planned, strict=True)]
        assert np.abs(early).max(initial=0.0) <= 0.0005 + 1e-9


def test_hips_follow_the_plan(run: Solved) -> None:
    table, plan = run.run.controller, run.plan
    clock = table.time - LEAD
    for leg in ("front", "rear"):
        for name in ("q", "w"):
            expected = np.interp(clock, plan.time, plan[f"{leg}/hip/{name}"])
            assert table[f"{leg}/hip/{name}"] == pytest.approx(expected, abs=1e-12)
        torque = table[f"{leg}/hip/tau"]
        assert np.all(torque[clock < -1e-9] == 0.0), "nothing before the motion"
        assert np.abs(torque).max() <= np.abs(plan[f"{leg}/hip/tau"]).max() + 1e-12
        steps = np.diff(plan.time)
        planned = float(np.sum(np.abs(plan[f"{leg}/hip/tau"][1:]) * steps))
        assert float(np.sum(np.abs(torque)) * 0.001) == pytest.approx(planned, rel=0.1, abs=0.01)


def made(model_valves: dict[str, float], *extra: Effect) -> Trajectory:
    """The table of a hand-made plan: one extend pulse from 20 to 40 ms on a 10 ms grid."""
    time = np.linspace(0.0, 0.1, 11)
    model = load_model(extra=extra)
    columns = {q.header: 0.0 * time for q in model.inputs.values()}
    for leg in ("front", "rear"):
        columns |= {
            f"{leg}/hip/q [rad]": time,
            f"{leg}/hip/w [rad.s-1]": 1 + 0 * time,
            f"{leg}/piston/x [m]": 0 * time,
        }
    columns |= {f"body/{n}": time for n in ("x [m]", "z [m]", "pitch [rad]")}
    columns["front/valve/extend [1]"] = np.isin(np.arange(11), (3, 4)).astype(float)
    columns["front/hip/tau [N.m]"] = np.arange(11.0)
    if model_valves:
        valve = model.effect("valve").bind(model_valves)
        model = model.with_effects([valve])
    return controller_table(model, Trajectory(time, columns))


@pytest.mark.parametrize(("dead_time", "lead"), [(0.006, 0.006), (0.0095, 0.010), (0.0, 0.0)])
def test_a_pulse_by_hand(dead_time: float, lead: float) -> None:
    table = made({"dead_time": dead_time})
    assert table.meta["lead"] == lead
    found = switches(table.time, table["front/valve/extend"])
    sent = [lead + t - dead_time for t in (0.020, 0.040)]
    assert [value for _, value in found] == [1.0, 0.0]
    assert [time for time, _ in found] == pytest.approx(sent, abs=0.0005 + 1e-9)


def test_opening_and_closing_have_leads_of_their_own() -> None:
    """A valve that closes 4 ms later than it opens is told to close 4 ms earlier."""
    table = made({}, ValveCloseDelay(dt=0.004))
    lead = table.meta["lead"]
    assert lead == pytest.approx(0.010)
    (opens, _), (closes, _) = switches(table.time, table["front/valve/extend"])
    assert opens - lead == pytest.approx(0.020 - 0.006, abs=0.0005 + 1e-9)
    assert closes - lead == pytest.approx(0.040 - 0.010, abs=0.0005 + 1e-9)


def test_torques_stand_at_the_middle_of_their_step() -> None:
    table = made({})
    clock = table.time - LEAD
    inside = (clock > 0.005) & (clock < 0.095)
    assert table["front/hip/tau"][inside] == pytest.approx(0.5 + clock[inside] / 0.01)
