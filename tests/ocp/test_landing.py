"""Holding before the plan, clear feet in flight, soft landings, and goals that last or grow."""

import numpy as np
import pytest
from ocp.runs import Solved, solved

from kemba.config import Document, load_yaml
from kemba.effects.mechanics.ground import GroundCompliance
from kemba.errors import ConfigErrors, KembaError
from kemba.mechanism.knee import felt
from kemba.model import Model, load_model
from kemba.ocp import Task, load_task, task_model
from kemba.ocp.phases.modes import HELD, OPEN, drop_grazes
from kemba.ocp.planned import grazes, not_clear
from kemba.ocp.task.requirement import Requirement, landing_nodes
from kemba.ocp.task.resolve import resolve
from kemba.ocp.task.templates import longest_leg
from kemba.ocp.transcription.symmetry import whole
from kemba.ocp.transcription.transcribe import Transcription
from kemba.trajectory import Trajectory


def required(name: str, *overrides: str) -> list[Requirement]:
    task, document = load_task(name, list(overrides))
    return resolve(task, task_model(task), document)


def resolved_of(run: Solved) -> list[Requirement]:
    return resolve(run.task, run.model, load_yaml(run.run.task))


def test_a_goal_may_last() -> None:
    options = ["goals.high.quantity='*/foot/z'", "goals.high.during=[40 %, 60 %]"]
    found = required("jump.yaml", *options, "goals.high.at_least=5 cm")
    own = [r for r in found if r.location == ("goals", "high")]
    assert [r.quantity.name for r in own] == ["front/foot/z", "rear/foot/z"]
    assert own[0].nodes(10) == [4, 5, 6]
    assert own[0].nodes(100) == list(range(40, 61))
    assert own[0].holds(0.5) and not own[0].holds(0.61)


@pytest.mark.parametrize(
    ("goal", "told"),
    [
        ({"maximise": True, "minimise": True}, "does not go with 'minimise'"),
        ({"during": [0.4, 0.6], "maximise": True}, "need a moment"),
        ({"during": [0.4, 0.6], "at": "end", "equals": 1}, "does not go with 'at'"),
        ({"during": [0.6, 0.4], "equals": 1}, "from an earlier to a later"),
        ({"during": [40, 60], "equals": 1}, "out of range"),
    ],
)
def test_goals_that_make_no_sense(goal: dict[str, object], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        Task.model_validate({"goals": {"up": {"quantity": "body/z", **goal}}})


def test_a_soft_landing_on_soft_ground_bounds_the_stops_only() -> None:
    task, document = load_task("jump.yaml", ["landing.impact_speed=0.8 m/s"])
    model = task_model(task)
    assert len(_landing_rows(task, document, model)) == 6  # feet and both stops of two legs
    soft = model.with_effects([GroundCompliance()])
    rows = _landing_rows(task, document, soft)
    assert len(rows) == 4 and not any("contact" in label for label in rows)


def _landing_rows(task: Task, document: Document, model: Model) -> list[str]:
    found = Transcription(model, task, resolve(task, model, document), whole(model.node), 8)
    labels = (meaning.label for meaning in found.meanings)
    return [label for label in dict.fromkeys(labels) if label.startswith("landing.")]


def test_maximise_reaches_higher_than_at_least() -> None:
    """Of two plans of one task, only that which is to be as high as possible leaves the bound."""
    most, least = solved("max_jump"), solved("max_jump", "goals.apex.maximise=false")
    assert most.plan["body/z"][-1] > least.plan["body/z"][-1] + 0.05
    assert least.plan["body/z"][-1] == pytest.approx(1.0, abs=1e-3)


def test_the_feet_are_clear_in_the_middle_of_the_flight() -> None:
    found = [r for r in required("jump.yaml", "clearance=3 cm") if r.location == ("clearance",)]
    assert [(r.quantity.name, r.lower) for r in found] == [
        ("front/foot/z", 0.03),
        ("rear/foot/z", 0.03),
    ]
    begin, end = found[0].during
    assert begin + end == pytest.approx(1.0) and 0.1 < end - begin < 0.5
    run = solved("jump")
    rows = found[0].nodes(len(run.plan) - 1)
    for leg in ("front", "rear"):
        assert run.plan[f"{leg}/foot/z"][rows].min() >= 0.03 - 1e-6


def test_a_low_jump_has_the_clearance_of_stretched_legs() -> None:
    def least(*options: str) -> list[float]:
        found = required("jump.yaml", *options)
        return sorted({r.lower for r in found if r.location == ("clearance",)})

    assert least() == [0.03]
    drop = 0.48 - longest_leg(load_model().mechanism.need_robot())
    assert 0.03 < drop < 0.05
    assert least("height=0.48 m") == [pytest.approx(0.51 * drop)]
    assert least("height=0.43 m") == []
    assert least("height=0.43 m", "folding=true") == [0.03]


def test_clearance_needs_a_flight() -> None:
    with pytest.raises(ConfigErrors, match="clearance: needs a goal for body/z"):
        required("drop.yaml", "clearance=2 cm")


def test_impacts_of_the_landing_are_slow() -> None:
    """By hand: the speed of every gap in the row before it closes, after the apex."""
    run = solved("jump")
    assert run.task.landing.impact_speed == 0.8
    landing = landing_nodes(resolved_of(run), len(run.plan) - 1)
    leg = felt(run.model.mechanism, "front/end_stop:retracted")
    for name, factor in (("front/foot/z", 1.0), ("rear/piston/x", leg)):
        gap, time = run.plan[name], run.plan.time
        hits = [k for k in landing if gap[k] < 1e-7 < gap[k - 1]]
        assert hits, name
        for k in hits:
            before = (gap[k - 2] - gap[k - 1]) / (time[k - 1] - time[k - 2])
            assert factor * before <= 0.8 * 1.05, (name, k)


def test_a_leg_at_its_stop_is_faster_than_its_piston() -> None:
    """The distance from hip to foot by finite differences of the knee's closed loop."""
    mechanism = load_model().mechanism
    leg = mechanism.need_robot().leg

    def length(x: float) -> float:
        from kemba.mechanism.knee import flexion

        f, t = leg.femur.length, leg.tibia.length
        return float(np.sqrt(f**2 + t**2 + 2 * f * t * np.cos(flexion(leg, x))))

    assert felt(mechanism, "front/contact:gap") == 1.0
    for pair, a, b in (("retracted", 0.0, 1e-6), ("extended", 0.07 - 1e-6, 0.07)):
        by_hand = (length(b) - length(a)) / 1e-6
        assert felt(mechanism, f"front/end_stop:{pair}") == pytest.approx(by_hand, rel=1e-3)


def flight(*down: tuple[float, float]) -> Trajectory:
    """A foot that is on the ground in these spans only, rows of 1 ms up to 0.1 s."""
    time = np.arange(101) * 1e-3
    z = np.full(101, 0.05)
    for a, b in down:
        z[(time >= a - 1e-9) & (time <= b + 1e-9)] = 0.0
    return Trajectory(time, {"front/foot/z [m]": z})


def test_grazes_are_short_contacts_in_flight() -> None:
    found = grazes(flight((0.0, 0.01), (0.04, 0.044), (0.08, 0.1)))
    assert [(g.foot, round(g.time, 6)) for g in found] == [("front/foot", 0.04)]
    assert found[0].sentence == (
        "front/foot touches the ground for 4 ms at 0.040 s and leaves again"
    )
    assert not grazes(flight((0.0, 0.01), (0.04, 0.07), (0.09, 0.1)))
    assert not grazes(flight((0.0, 0.01), (0.095, 0.1)))


def test_a_graze_is_told_with_its_line() -> None:
    task, _ = load_task("jump.yaml", ["clearance=3 cm"])
    (graze,) = grazes(flight((0.0, 0.01), (0.04, 0.044), (0.08, 0.1)))
    assert not_clear(task, graze) == (
        f"`clearance` (--set clearance=3 cm): 0.03 m is asked, but {graze.sentence}"
    )


def test_an_implicit_euler_contact_begins_with_its_step() -> None:
    """Down at one row only: the ground pushes in the whole step before it."""
    touch = flight((0.0, 0.01), (0.04, 0.044), (0.08, 0.1))
    (graze,), (longer,) = grazes(touch), grazes(touch, euler=True)
    step = float(touch.time[1] - touch.time[0])
    assert longer.time == pytest.approx(graze.time - step)
    assert longer.duration == pytest.approx(graze.duration + step)


def test_grazes_are_left_out_of_the_modes() -> None:
    time = np.arange(8) * 5e-3
    modes = np.array([OPEN, HELD, OPEN, HELD, HELD, OPEN, HELD, HELD])
    drop_grazes(modes, time, 0.02)
    assert modes.tolist() == [OPEN, HELD, OPEN, OPEN, OPEN, OPEN, HELD, HELD]
    kept = np.array([OPEN, HELD, OPEN, HELD, HELD, OPEN, HELD, HELD])
    drop_grazes(kept, time, 0.0)
    assert kept[3] == HELD


def test_a_hold_out_of_range_is_refused() -> None:
    with pytest.raises(KembaError, match="hold"):
        load_task("jump.yaml", ["hold=-1 s"])
