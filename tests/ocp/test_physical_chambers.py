"""Plans with physical chambers are sought with first-order ones, and are refined with their own."""

from kemba.ocp.planned import Plan
from kemba.ocp.planning import Planning, guesses
from kemba.ocp.reading import load_task
from kemba.plant.replay import replay

JUMP = ["model=orifice", "nodes=60"]


def planning() -> Planning:
    return Planning.of(*load_task("jump.yaml", JUMP))


def test_what_is_asked_of_pressures_is_asked_of_forces_while_a_plan_is_sought() -> None:
    p = planning().planner
    assert p.lags is not None and p.seeking.model is p.lags[0]
    names = {r.quantity.name for r in p.requirements}
    sought = {r.quantity.name for r in p.seeking.requirements}
    assert "front/chamber/extend/P" in names - sought
    assert "front/chamber/extend/F" in sought - names


def test_a_jump_is_refined_with_its_own_chambers_and_replays() -> None:
    found: Plan = next(planning().plans())
    assert found.refined and {"orifice_chamber", "supply_line"} <= {
        e.kind for e in found.model.effects
    }
    plan = found.trajectory
    pressed = plan["front/chamber/extend/P"].max()
    assert 4e5 < pressed < 8.5e5 and plan["supply/line/s"].min() < 0.9
    done = replay(found.model, plan)
    assert abs(done.apex_error_m) < 1e-3 and done.fault is None


def test_where_that_fails_they_are_sought_with_themselves() -> None:
    task, document = load_task("jump.yaml", JUMP)
    p = Planning.of(task, document).planner
    assert [guess.lags for guess in guesses(task, p.model)][:3] == [True, False, True]
    assert all(guess.lags for guess in guesses(task, p.seeking.model))
    plain = Planning.of(*load_task("jump.yaml", [*JUMP, "refine=none"])).planner
    assert plain.lags is None and plain.seeking is plain
