"""Valve edges of a plan on the controller's ticks: its table then is the plan."""

from dataclasses import replace

import numpy as np
import pytest

from kemba.model import Model, load_model
from kemba.ocp.continuation.continue_plan import edge_times
from kemba.ocp.continuation.origin import Origin
from kemba.ocp.controller import PERIOD
from kemba.ocp.phases.modes import Phase
from kemba.ocp.planned import Plan
from kemba.ocp.planning import Planning
from kemba.ocp.reading import load_task
from kemba.ocp.transcription.symmetry import find_symmetry, whole
from kemba.plant.replay import replay


def off_ticks(model: Model, plan: Plan) -> float:
    """How far [s] the worst edge of a plan is from a tick, its dead time taken off."""
    worst = 0.0
    for leg in model.mechanism.legs:
        on, off = model.timing(leg)
        for chamber in ("extend", "retract"):
            value = plan.trajectory[f"{leg}/valve/{chamber}"][1:]
            k = np.flatnonzero(np.diff(value, prepend=0.0))
            k = k[k > 0]  # the plan begins at 0, whatever the dead time
            sent = plan.trajectory.time[k] - np.where(value[k] > 0.5, on, off)
            ticks = sent / PERIOD
            worst = max(worst, PERIOD * float(np.abs(ticks - np.round(ticks)).max(initial=0.0)))
    return worst


def test_a_plan_on_ticks_has_its_edges_there() -> None:
    task, document = load_task("jump.yaml", ["height=0.54 m"])
    planning = Planning.of(task, document)
    old = next(planning.plans())
    known = (old.trajectory, old.model, old.requirements)
    origin = Origin(*known, once=True, ticks=True, stages=old.stages)
    new, why = planning.continued(origin)
    assert new is not None, why
    assert off_ticks(old.model, old) > 1e-4
    assert off_ticks(new.model, new) < 1e-8
    cost = [plan.cost["torque_squared_integral"] for plan in (old, new)]
    assert cost[1] == pytest.approx(cost[0], rel=0.05)


def test_the_same_plan_with_five_stages_an_element_executes_more_exactly() -> None:
    """Its own stages then begin what is solved from it."""
    task, document = load_task("jump_forward.yaml", ["nodes=60"])
    planning = Planning.of(task, document)
    plans = [next(planning.plans())]
    for how in ({"finer": True}, {"ticks": True}):
        last = plans[-1]
        known = last.trajectory, last.model, last.requirements
        found, why = planning.continued(
            replace(Origin(*known, once=True, stages=last.stages), **how)
        )
        assert found is not None, why
        plans.append(found)
    assert [p.stages.stages for p in plans if p.stages] == [3, 5, 5]
    assert off_ticks(plans[2].model, plans[2]) < 1e-8
    errors = [replay(p.model, p.trajectory).final_error_m for p in plans[:2]]
    assert errors[1] < 0.5 * errors[0]
    assert plans[1].objective == pytest.approx(plans[0].objective, rel=0.02)


def edges(half: bool, borders: list[float], shortest: float, longest: float) -> np.ndarray:
    """When four phases with a valve edge between each begin on ticks."""
    model = load_model("planning")
    reduction = find_symmetry(model) if half else whole(model.node)
    assert reduction is not None
    legs = 1 if half else 2
    patterns = [(1.0, 0.0), (0.0, 0.0), (0.0, 1.0), (1.0, 0.0)]
    phases = [Phase(i, i + 1, (), pattern * legs) for i, pattern in enumerate(patterns)]
    limits = np.full(4, shortest), np.full(4, longest)
    found = edge_times(model, reduction, phases, np.array([0.0, *borders]), *limits)
    assert list(found) == [1, 2, 3]
    return np.array(list(found.values()))


def test_edges_of_a_valve_stay_as_far_apart_as_it_must_dwell() -> None:
    """A pulse of just the dwell whose begin waits for the phase before it would end too soon."""
    model, dwell = load_model("planning"), 0.01
    valves = [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (0.0, 1.0)]
    phases = [Phase(i, i + 1, (), (*own, 0.0, 0.0)) for i, own in enumerate(valves)]
    borders = np.array([0.0, 0.0998, 0.1, 0.11])
    limits = np.array([0.0, 1.2e-3, 0.0, 0.0]), np.ones(4)

    def pulse(*least: float) -> float:
        found = edge_times(model, whole(model.node), phases, borders, *limits, *least)
        return found[3] - found[2]

    assert pulse() < dwell - PERIOD / 2
    assert dwell - 1e-9 < pulse(dwell) < dwell + PERIOD


@pytest.mark.parametrize("half", [True, False])
def test_edges_are_near_and_in_order(half: bool) -> None:
    borders = [0.1234, 0.1567, 0.1999]
    times = edges(half, borders, 0.0, 1.0)
    assert np.all(np.diff(times) > 0) and np.abs(times - borders).max() < PERIOD


@pytest.mark.parametrize(
    ("borders", "shortest", "longest"),
    [
        ([0.1234, 0.12375, 0.1242], 3e-4, 1.0),  # three edges within a tick
        ([0.0196, 0.0396, 0.0596], 0.0, 0.02),  # phases that are as long as they may be
    ],
)
def test_edges_leave_phases_durations_that_they_may_have(
    borders: list[float], shortest: float, longest: float
) -> None:
    times = edges(True, borders, shortest, longest)
    lasts = np.diff(times, prepend=0.0)
    assert np.all(lasts >= shortest - 1e-9) and np.all(lasts <= longest + 1e-9)
    assert np.abs(times - borders).max() < 3 * PERIOD
