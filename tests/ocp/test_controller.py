"""controller.csv: 1 kHz, hips interpolated, valves switched the dead time early."""

import numpy as np
import pytest
from ocp.runs import QUICK, Solved, solved

from kemba.effects import Effect
from kemba.effects.pneumatics.valve import ValveCloseDelay
from kemba.model import load_model
from kemba.ocp import controller_table
from kemba.ocp.controller import ValveEdges, _means, rounded
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
    lead = max(LEAD, run.task.hold)
    assert table.time[0] == -lead
    assert 0.0 <= table.time[-1] - plan.time[-1] < 0.001
    assert table.meta == {"kind": "controller", "lead": lead}


def test_valves_are_sent_the_dead_time_early(run: Solved) -> None:
    """What acts on (t[k-1], t[k]] stands at node k; it is sent 6 ms before t[k-1], by the clock
    of the plan."""
    table, plan = run.run.controller, run.plan
    for name in VALVES:
        assert set(table[name]) <= {0.0, 1.0}
        starts = np.concatenate([[plan.time[0]], plan.time[:-1]])
        planned = switches(starts[1:], plan[name][1:])
        sent = switches(table.time, table[name])
        assert [value for _, value in sent] == [value for _, value in planned]
        early = [begin - LEAD - time for (time, _), (begin, _) in zip(sent, planned, strict=True)]
        assert np.abs(early).max(initial=0.0) < 0.001, "the tick before or the one after"


def test_hips_follow_the_plan(run: Solved) -> None:
    table, plan = run.run.controller, run.plan
    clock = table.time
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
    assert table.time[0] == -lead
    sent = [t - dead_time for t in (0.020, 0.040)]
    assert [value for _, value in found] == [1.0, 0.0]
    assert [time for time, _ in found] == pytest.approx(sent, abs=0.0005 + 1e-9)


def test_opening_and_closing_have_leads_of_their_own() -> None:
    """A valve that closes 4 ms later than it opens is told to close 4 ms earlier."""
    table = made({}, ValveCloseDelay(dt=0.004))
    assert table.meta["lead"] == -table.time[0] == pytest.approx(0.010)
    (opens, _), (closes, _) = switches(table.time, table["front/valve/extend"])
    assert opens == pytest.approx(0.020 - 0.006, abs=0.0005 + 1e-9)
    assert closes == pytest.approx(0.040 - 0.010, abs=0.0005 + 1e-9)


def test_torques_are_means_over_their_tick() -> None:
    """What is k N.m on (t[k-1], t[k]] has its own angular impulse in the table."""
    table = made({})
    inside = (table.time > -1e-9) & (table.time < 0.1 - 1e-9)
    assert table["front/hip/tau"][inside] == pytest.approx(np.repeat(np.arange(1.0, 11.0), 10))


def test_a_torque_that_changes_within_a_tick_keeps_its_impulse() -> None:
    time = np.array([0.0, 0.0103, 0.0206, 0.0309])
    torque = np.array([0.0, 3.0, -5.0, 2.0])
    means = _means(time, torque, np.arange(31) * 1e-3)
    assert means[10] == pytest.approx(0.3 * 3.0 + 0.7 * -5.0)
    planned = float(np.sum(torque[1:] * np.diff(time)))
    assert float(np.sum(means)) * 1e-3 == pytest.approx(planned + 2.0 * 0.0001)


def test_pulses_keep_their_length() -> None:
    """Alone, 10.4 and 20.6 go to 10 and 21: a pulse that is 0.8 ticks too long."""
    assert rounded([ValveEdges([10.4, 20.6], 0, 1.0)]) in ([[10, 20]], [[11, 21]])


def test_both_sides_of_a_piston_make_up_for_each_other() -> None:
    """A push that ends 0.36 ticks early must not meet a pull that begins 0.36 early as well."""
    out, back = rounded([ValveEdges([0.0, 198.36], 0, 1.0), ValveEdges([198.36], 0, -1.0)])
    assert sorted((out[1], back[0])) == [198, 199]


def test_legs_that_do_the_same_stay_alike() -> None:
    edges = [3.5, 17.2, 40.5, 61.9]
    front, rear = rounded([ValveEdges(edges, 0, 1.0), ValveEdges(edges, 1, 1.0)])
    assert front == rear


def test_edges_keep_their_order_and_none_is_lost() -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        valves = [
            ValveEdges(np.cumsum(rng.uniform(0.2, 9.0, 6)).tolist(), leg, force)
            for leg in (0, 1)
            for force in (1.0, -1.0)
        ]
        found = rounded(valves)
        for valve, ticks in zip(valves, found, strict=True):
            assert len(ticks) == len(valve.edges)
            assert (np.diff(ticks) >= 1).all()
        pairs = sorted(zip(found[0], valves[0].edges, strict=True))
        assert [time for _, time in pairs] == sorted(valves[0].edges)
