"""`grip`: plans that use a part of the ground's friction, on a ground that has all of it."""

from functools import cache

import numpy as np
import pytest

from kemba.errors import ConfigErrors
from kemba.ocp import Plan, controller_table, load_task
from kemba.ocp.certificate.asked import grip_of
from kemba.ocp.certificate.status import Status
from kemba.ocp.planning import plan
from kemba.ocp.reading import asked_of
from kemba.plant.controller import execute
from kemba.plant.retiming import retimed
from kemba.solve.judged import judged, plant_of
from kemba.trajectory import Trajectory


@cache
def high(grip: float) -> Plan:
    """A jump of 0.84 m, which leans on the friction as far as it goes."""
    task, document = load_task("jump.yaml", ["height=0.84 m", "duration=0.7 s", f"grip={grip}"])
    return plan(task, document)


@pytest.mark.slow
def test_a_plan_keeps_to_its_share_of_the_friction() -> None:
    assert grip_of(high(1.0).model, high(1.0).trajectory) > 0.9
    assert grip_of(high(0.5).model, high(0.5).trajectory) == pytest.approx(0.5, abs=1e-3)
    assert high(0.5).status is Status.SOLVED
    cost = [high(grip).cost["torque_squared_integral"] for grip in (1.0, 0.5)]
    assert cost[0] < cost[1]


def table_of(found: Plan) -> Trajectory:
    table = controller_table(found.model, found.trajectory, found.task.hold)
    return retimed(found.model, found.trajectory, table)


def test_it_is_planned_and_judged_on_the_ground_of_its_model() -> None:
    found = high(0.5)
    assert found.model.effect("contact").value("mu") == 1.0
    assert plant_of(found.task).effect("contact").value("mu") == 1.0
    assert judged(found, table_of(found)).replays


@pytest.mark.parametrize(("grip", "slips"), [(1.0, True), (0.5, False)])
def test_it_does_not_slip_where_the_ground_has_no_more(grip: float, slips: bool) -> None:
    """On the planning model with half the friction, up to the take-off."""
    found = high(grip)
    ground = found.model.effect("contact").bind({"mu": 0.52})
    done = execute(table_of(found), found.model.with_effects([ground])).trajectory
    push = (done.time > 0.0) & (done.time < 0.14)
    feet = np.concatenate([done[f"{leg}/foot/vx"][push] for leg in ("front", "rear")])
    assert (np.abs(feet).max() > 0.05) == slips


def test_a_plan_from_a_guess_keeps_to_it() -> None:
    """A jump that needs 0.23 of the friction."""
    task, document = load_task(
        "jump.yaml", ["duration=0.7 s", "nodes=50", "grip=0.15", "guess_noise=0.01"]
    )
    found = plan(task, document)
    assert found.status is Status.SOLVED, found.sentence
    assert grip_of(found.model, found.trajectory) < 0.151


def test_implicit_euler_plans_cannot_have_it() -> None:
    task, document = load_task("jump.yaml", ["grip=0.5", "refine=none"])
    with pytest.raises(ConfigErrors, match="grip: needs the refined plan"):
        asked_of(task, document)
