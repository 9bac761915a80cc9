"""A plan in a scene from one on level ground: how its steps go, and when it is tried."""

from dataclasses import is_dataclass, replace
from types import SimpleNamespace
from typing import Any

import pytest

from kemba.ocp import raised
from kemba.ocp.planning import Planning
from kemba.ocp.reading import load_task

HIGHEST = 0.6  # of the scene, in the stiff example: beyond, only small steps are solved


def steps_of(
    monkeypatch: pytest.MonkeyPatch, widest: Any, over: int = 1000, anew: list[float] | None = None
) -> tuple[list[Any], Any]:
    """The shares that are tried where a step from `share` is solved if it is no wider than
    `widest(share)`, and what comes of it. `over`: tries after which time is over. `anew`: gets
    those that may read phases anew."""
    tried: list[Any] = []
    solved = [0.0]
    plan: Any = SimpleNamespace(origin=lambda name, once: SimpleNamespace(once=once))

    def continued(share: Any, origin: Any) -> tuple[Any, str]:
        tried.append(share)
        if anew is not None and not origin.once:
            anew.append(share)
        if share - solved[-1] > widest(solved[-1]):
            return None, "no solution near"
        solved.append(share)
        return plan, ""

    ended = SimpleNamespace(ended=lambda: len(tried) >= over)
    planner: Any = SimpleNamespace(session=SimpleNamespace(control=ended, tell=lambda _: None))
    monkeypatch.setattr(raised, "continued", continued)
    monkeypatch.setattr(raised, "lowered", lambda planner, document, share: share)
    monkeypatch.setattr(raised, "replace", lambda plan, **new: SimpleNamespace(**new))
    return tried, raised.raised(plan, planner, SimpleNamespace())  # type: ignore[arg-type]


def test_steps_double_where_they_are_solved(monkeypatch: pytest.MonkeyPatch) -> None:
    tried, found = steps_of(monkeypatch, lambda share: 1.0)
    assert tried == [0.125, 0.375, 0.875, 1.0]
    assert found.start == "level ground"


def test_steps_halve_where_they_are_not(monkeypatch: pytest.MonkeyPatch) -> None:
    tried, found = steps_of(monkeypatch, lambda share: 0.1 if share > HIGHEST else 0.3)
    assert found is not None and tried[-1] == 1.0
    assert 0.875 in tried and 0.625 in tried


def test_there_is_no_plan_where_no_small_step_is_solved(monkeypatch: pytest.MonkeyPatch) -> None:
    tried, found = steps_of(monkeypatch, lambda share: 0.0 if share > HIGHEST else 1.0)
    assert found is None
    assert tried[-1] - 0.875 == pytest.approx(raised.LEAST)


def test_phases_are_read_anew_by_the_smallest_step_only(monkeypatch: pytest.MonkeyPatch) -> None:
    anew: list[float] = []
    tried, _ = steps_of(monkeypatch, lambda share: 0.0 if share > HIGHEST else 1.0, anew=anew)
    assert anew == tried[-1:]


def test_there_is_no_plan_where_time_is_over(monkeypatch: pytest.MonkeyPatch) -> None:
    assert steps_of(monkeypatch, lambda share: 1.0, over=2)[1] is None


@pytest.mark.parametrize(
    ("task", "settings", "rises"),
    [
        ("platform.yaml", [], True),
        ("hurdle.yaml", [], True),
        ("hurdle.yaml", ["refine=none"], False),
        ("jump.yaml", [], False),
        ("jump.yaml", ["terrain=[{from: 0.2 m, slope: 5 deg}]"], True),
        ("jump.yaml", ["terrain=[{from: 0.2 m, friction: 0.5}]"], False),
        ("double_jump.yaml", [], False),
    ],
)
def test_scenes_rise_where_there_is_one(task: str, settings: list[str], rises: bool) -> None:
    assert raised.rises(load_task(task, settings)[0]) is rises


def test_the_plan_on_level_ground_has_no_walls() -> None:
    planning = Planning.of(*load_task("platform.yaml"))
    level = raised.lowered(planning.planner, planning.document, 0.0)
    assert level.model.mechanism.scene.ground.level == 0.0
    asked = [
        {r.quantity.name for r in one.requirements if "/distance" in r.quantity.name}
        for one in (planning.planner, level)
    ]
    assert asked[0] and not asked[1]
    low = raised.lowered(planning.planner, planning.document, 0.5)
    assert low.model.mechanism.scene.ground.height(0.6) == pytest.approx(0.075)


def test_what_certainly_cannot_be_met_is_not_sought_on_level_ground(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    planning = Planning.of(*load_task("platform.yaml", ["end.body/z=0.9 m"]))
    monkeypatch.setattr(Planning, "_raised", lambda _: pytest.fail("it was sought"))
    assert planning.refused is not None
    assert [plan.refined for plan in planning.plans()] == [False]


def test_every_step_has_the_air_of_the_task() -> None:
    planning = Planning.of(*load_task("hurdle.yaml"))
    half = raised.lowered(planning.planner, planning.document, 0.5)
    kinds = [{e.kind for e in planner.model.effects} for planner in (half, half.seeking)]
    assert "orifice_chamber" in kinds[0] - kinds[1]


def test_level_ground_and_the_scene_take_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of each guess the plan from level ground, if the scene rises from it, then its own."""
    made: list[str] = []

    def changed(old: Any, **new: Any) -> Any:
        return replace(old, **new) if is_dataclass(old) else old

    def from_guess(self: Planning, guess: Any, new: Any) -> Any:
        where = "level" if self.planner.task.scene.ground.level is not None else "scene"
        made.append(where)
        return SimpleNamespace(
            status=SimpleNamespace(plan=True), refined=True, plain=None, start="guess"
        )

    planning = Planning.of(*load_task("platform.yaml"))
    monkeypatch.setattr(Planning, "_from_guess", from_guess)
    monkeypatch.setattr("kemba.ocp.planning._Orders.keep", lambda *_: None)
    monkeypatch.setattr("kemba.ocp.planning.replace", changed)
    monkeypatch.setattr("kemba.ocp.planning.raised", lambda *_: None)
    list(planning.plans())
    assert made[:4] == ["level", "scene", "level", "scene"]
