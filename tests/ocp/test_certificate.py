"""The certificate on plans made by hand: every residual is measured, every tolerance is kept."""

import numpy as np
import pytest
from ocp.runs import solved
from ocp.toys import Push, bead

from kemba.config import Document, load_yaml
from kemba.model import Model
from kemba.ocp.certificate.certify import Certificate, certify
from kemba.ocp.certificate.status import verdict
from kemba.ocp.nlp.ending import Ending
from kemba.ocp.task.resolve import resolve
from kemba.ocp.task.task import Task, Tolerances
from kemba.trajectory import Trajectory

STEP = 0.1  # s
FORCE = np.array([0.0, 0.5, 0.5, -0.5, -0.5])  # N; row k acts on the interval before node k
TASK = {
    "name": "by hand",
    "start": {"body/x": 0.0, "body/vx": 0.0},
    "end": {"body/vx": {"at_least": "-1 cm/s", "at_most": "1 cm/s"}},
    "duration": 0.4,
    "nodes": 4,
    "cost": {},
}


def measured(
    force: np.ndarray = FORCE, moved: np.ndarray | float = 0.0, kicked: np.ndarray | float = 0.0
) -> Certificate:
    """The certificate of a bead of 1 kg pushed by `force` [N], an exact implicit Euler plan, after
    its positions were `moved` [m] and its speeds `kicked` [m/s]."""
    v = np.cumsum(STEP * force)
    x = np.cumsum(STEP * v)
    columns = {"body/x [m]": x + moved, "body/vx [m.s-1]": v + kicked, "push/F [N]": force}
    task, model = Task.model_validate(TASK), Model(bead(), [Push()])
    plan = Trajectory(STEP * np.arange(len(force)), columns)
    return certify(model, task, resolve(task, model, Document(TASK)), plan)


def test_an_exact_plan_violates_nothing() -> None:
    found = measured()
    assert found.worst == ()
    assert max(found.dynamics, found.bounds, found.complementarity, found.binary) < 1e-12
    assert found.within(Tolerances())


@pytest.mark.parametrize("force", [1.25, -1.25])
def test_an_input_above_or_below_its_range_is_told(force: float) -> None:
    """Push may give 1 N either way; here it gives more in one step, one way."""
    found = measured(np.array([0.0, 0.0, force, 0.0, 0.0]))
    assert found.bounds == pytest.approx(0.25)
    beyond = next(v for v in found.worst if v.what == "bound:push/F")
    assert (beyond.node, beyond.violation) == (2, pytest.approx(0.25))
    assert not found.within(Tolerances())


@pytest.mark.parametrize("speed", [60.0, -60.0])
def test_the_first_node_keeps_its_bounds_as_well(speed: float) -> None:
    """A bead goes 50 m/s at most."""
    found = measured(kicked=np.array([speed, 0.0, 0.0, 0.0, 0.0]))
    beyond = next(v for v in found.worst if v.what == "bound:body/vx")
    assert (beyond.node, beyond.violation) == (0, pytest.approx(10.0))


@pytest.mark.parametrize("speed", [0.03, -0.03])
def test_a_requirement_missed_on_either_side_is_told(speed: float) -> None:
    """The plan comes to rest; 1 cm/s either way is allowed at its end."""
    found = measured(kicked=np.array([0.0, 0.0, 0.0, 0.0, speed]))
    missed = next(v for v in found.worst if v.what == "end.body/vx:body/vx")
    assert (missed.node, missed.violation) == (4, pytest.approx(0.02))
    assert found.missed[0].miss == pytest.approx(0.02)
    assert found.sound(Tolerances(dynamics=1.0)) and not found.within(Tolerances(dynamics=1.0))


def test_a_speed_that_no_force_explains_is_a_defect() -> None:
    found = measured(kicked=np.array([0.0, 0.0, 2e-4, 0.0, 0.0]))
    worst = next(v for v in found.worst if v.what.startswith("dynamics"))
    assert worst.node in (2, 3) and worst.violation == pytest.approx(2e-3)  # N, of 1 kg
    assert not found.within(Tolerances())


def test_a_position_that_no_speed_explains_is_a_defect() -> None:
    found = measured(moved=np.array([0.0, 0.0, 1e-3, 1e-3, 1e-3]))
    assert found.worst[0].what == "kinematics:body/x"
    assert (found.worst[0].node, found.worst[0].violation) == (2, pytest.approx(1e-3))
    assert found.dynamics == pytest.approx(1e-3)


def test_a_foot_below_the_ground_and_a_pulling_one_are_told() -> None:
    """A jump that is solved, sunk by 1 mm, or with the ground's forces turned."""
    run = solved("jump")
    requirements = resolve(run.task, run.model, load_yaml(run.run.task))

    def changed(name: str, values: np.ndarray) -> Certificate:
        plan = run.plan.with_columns({f"{name} [{run.plan.unit(name)}]": values})
        return certify(run.model, run.task, requirements, plan, most=1000)

    sunk = changed("body/z", run.plan["body/z"] - 1e-3)
    told = [v for v in sunk.worst if (v.what, v.unit) == ("front/contact:gap", "m")]
    assert [v.violation for v in told] == [pytest.approx(1e-3, abs=1e-5)]
    assert sunk.bounds >= 0.9e-3
    pulling = changed("front/foot/Fz", -run.plan["front/foot/Fz"])
    assert pulling.bounds > 0.1
    assert run.measured.bounds < 1e-6


NAMES = ("complementarity", "binary", "dynamics", "bounds")


@pytest.mark.parametrize("name", NAMES)
def test_each_residual_has_its_own_tolerance(name: str) -> None:
    """Just within is within, twice as much is not; valves must be exactly 0 or 1."""
    allowed = Tolerances()
    limit = 0.0 if name == "binary" else getattr(allowed, name)
    perfect = dict.fromkeys(NAMES, 0.0)
    assert Certificate(**perfect | {name: limit}, worst=()).within(allowed)
    assert not Certificate(**perfect | {name: 2 * limit or 1e-12}, worst=()).within(allowed)


@pytest.mark.parametrize("name", NAMES[:1] + NAMES[2:])
@pytest.mark.parametrize(("times", "status"), [(1, "solved"), (50, "acceptable"), (200, "stalled")])
def test_the_status_follows_what_was_measured(name: str, times: float, status: str) -> None:
    """Whatever the solver says of itself: up to the tolerance a plan is solved, up to a hundred
    times as much acceptable."""
    task = Task.model_validate(TASK)
    size = times * getattr(task.tolerances, name)
    found = Certificate(**dict.fromkeys(NAMES, 0.0) | {name: size}, worst=())
    plan = Trajectory(np.arange(3.0), {"body/z [m]": np.zeros(3)})
    assert verdict(task, found, plan, Ending.STALLED)[0] == status
