"""`landing.air`: a pulse of air on stretched legs in the rise of a jump."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kemba.errors import ConfigErrors
from kemba.mechanism.knee import extension
from kemba.model import Model
from kemba.ocp import controller_table, load_task, task_model
from kemba.ocp.certificate.status import Status
from kemba.ocp.continuation.between import Origin
from kemba.ocp.phases.modes import Phase
from kemba.ocp.phases.notes import noted_phases
from kemba.ocp.phases.stretched import extending, rising, stretched, stretching
from kemba.ocp.planning import plan_from
from kemba.ocp.refinement.refine import reduction_of
from kemba.ocp.shipped.entry import read_plan
from kemba.ocp.shipped.kind import kind_of
from kemba.ocp.shipped.shelf import neighbours
from kemba.ocp.task.requirement import resolve
from kemba.ocp.transcription.unilateral import Constraint, read_constraints
from kemba.plant.execution.controller import execute
from kemba.plant.execution.counterpart import counterpart
from kemba.trajectory import Trajectory

AIR = 0.01


def kept(*options: str) -> tuple[Trajectory, list[Phase], list[Constraint], list[bool]]:
    """The shipped plan of `jump`, its phases, their constraints, and which valves extend."""
    task, document = load_task("jump.yaml", options)
    model = task_model(task)
    plan = neighbours(task, model)[0].entry.plan
    reduction = reduction_of(model, task, resolve(task, model, document), plan)
    constraints, extends = read_constraints(model, reduction), extending(model, reduction)
    phases = noted_phases(plan.meta, constraints, len(extends), len(plan) - 1)
    assert phases is not None
    return plan, phases, list(constraints), extends


def pulses(plan: Trajectory, phases: list[Phase], air: list[int], extends: list[bool]) -> float:
    """For how long [s] the phases `air` let air onto the legs."""
    own = [phases[p] for p in air if stretching(phases[p], extends)]
    return float(sum(plan.time[p.last] - plan.time[p.first] for p in own))


def test_a_pulse_is_put_where_the_legs_rest_on_their_stops() -> None:
    plan, phases, constraints, extends = kept("height=0.5 m")
    found, now = stretched(plan, phases, constraints, extends, 50, AIR)
    assert len(now) == len(phases) + 2
    assert now[-1].last == len(found) - 1 == len(plan) - 1
    assert [p.first for p in now[1:]] == [p.last for p in now[:-1]]
    assert np.all(np.diff(found.time) > 0.0)
    air = rising(now, constraints, 50)
    pulse = next(now[p] for p in air if stretching(now[p], extends))
    stop = next(i for i, c in enumerate(constraints) if c.label.endswith("extended"))
    assert pulse.active(stop)
    assert pulses(found, now, air, extends) == pytest.approx(AIR)
    again = stretched(found, now, constraints, extends, 50, AIR)
    assert again == (found, now)


def test_a_robot_that_stays_on_the_ground_has_no_pulse() -> None:
    plan, phases, constraints, extends = kept("height=0.4 m")
    assert stretched(plan, phases, constraints, extends, 50, AIR) == (plan, phases)


def test_the_pulse_stretches_the_legs_of_the_plant() -> None:
    """Without it, pistons fly 1 to 2 cm short of their stops, so that the feet come down late."""
    task, _ = load_task("jump.yaml", ["height=0.7 m"])
    model = task_model(task)
    plan = with_pistons(read_plan(Path(__file__).parent / "plans" / "stretched-0700.npz"), model)
    table = controller_table(model, plan, task.hold)
    plant = counterpart(task.model, task.payload, task.supply, task.plant)
    assert plant is not None
    apex = float(plan.time[np.argmax(plan["body/z"])])
    took_off = 0.22
    columns = {}
    for header, name in zip(table.headers, table.names, strict=True):
        columns[header] = table[name].copy()
        if name.endswith("valve/extend"):
            columns[header][(table.time > took_off) & (table.time < apex)] = 0.0
    without = Trajectory(table.time, columns, table.meta)
    assert any((table[n] != without[n]).any() for n in table.names)
    short = []
    for played in (table, without):
        motion = execute(played, plant).trajectory
        there = float(np.interp(apex, motion.time, motion["front/piston/x"]))
        short.append(float(np.interp(apex, plan.time, plan["front/piston/x"])) - there)
    assert short[0] < 0.005
    assert short[1] > 0.01


def with_pistons(plan: Trajectory, model: Model) -> Trajectory:
    """A kept plan with the pistons' places, which a table has too."""
    leg = model.mechanism.need_robot().leg
    places = {
        f"{name}/piston/x [m]": np.array(
            [float(extension(leg, abs(k))) for k in plan[f"{name}/knee/q"]]
        )
        for name in model.mechanism.legs
    }
    return plan.with_columns(places)


@pytest.mark.parametrize(
    ("overrides", "told"),
    [
        (["refine=none"], "needs the refined plan"),
        (["goals.apex.quantity=front/hip/z"], "needs a goal for body/z"),
    ],
)
def test_tasks_that_cannot_have_it(overrides: list[str], told: str) -> None:
    task, document = load_task("jump.yaml", ["landing.air=10 ms", "clearance=0 m", *overrides])
    with pytest.raises(ConfigErrors, match=told):
        resolve(task, task_model(task), document)


def test_plans_with_and_without_begin_each_other() -> None:
    kinds = set()
    for overrides in ([], ["landing.air=10 ms"], ["landing.impact_speed=0.7 m/s"]):
        task, _ = load_task("jump.yaml", overrides)
        kinds.add(kind_of(task, task_model(task)))
    assert len(kinds) == 2


@pytest.mark.slow
def test_a_longer_pulse_is_kept() -> None:
    """15 ms are more than a valve's shortest time, so that the row of its own holds."""
    task, document = load_task("jump.yaml", ["height=0.74 m"])
    model = task_model(task)
    asked = tuple(resolve(task, model, document))
    plan = read_plan(Path(__file__).parent / "plans" / "up-0740.npz")
    new, document = load_task("jump.yaml", ["height=0.74 m", "landing.air=15 ms"])
    found, why = plan_from(Origin(plan, model, asked, once=True), new, document)
    assert found is not None, why
    assert found.status is Status.SOLVED
    motion = found.trajectory
    air = (motion["front/foot/z"] > 1e-6) & (motion.time < motion.time[50] + 1e-9)
    steps = np.diff(motion.time, prepend=motion.time[0])
    opened = steps[air & (np.round(motion["front/valve/extend"]) == 1)].sum()
    assert opened == pytest.approx(0.015, abs=1e-6)
