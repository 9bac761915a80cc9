"""Which plans the plant may keep to, seen before they are refined."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from kemba.errors import KembaError
from kemba.ocp.task.task import Tolerances
from kemba.solve.judged import promising
from kemba.solve.truth import LEARNT, PLANT, Truth
from kemba.trajectory import Trajectory

PLAN = SimpleNamespace(
    task=SimpleNamespace(tolerances=Tolerances(), hold=0.3),
    model=None,
    trajectory=Trajectory([0.0, 0.5], {"body/z [m]": [0.5, 0.2], "body/vz [m.s-1]": [0.0, -2.0]}),
)


@pytest.fixture
def differing(monkeypatch: pytest.MonkeyPatch) -> dict[str, object]:
    """The executions of the plan's table, by their keys."""
    done: dict[str, object] = {}
    for name in ("controller_table", "plant_of"):
        monkeypatch.setattr(f"kemba.solve.judged.{name}", lambda *known: None)
    monkeypatch.setattr("kemba.solve.judged.truth_of", lambda task: Truth(PLANT))
    monkeypatch.setattr("kemba.solve.judged.executions", lambda *known: done)
    return done


def by(apex: float, touchdown: float | None) -> SimpleNamespace:
    return SimpleNamespace(apex_error_m=apex, touchdown_error_s=touchdown)


@pytest.mark.parametrize(
    ("own", "plant", "may"),
    [
        ((0.02, 0.04), (-0.03, 0.0), True),  # an unrefined plan is off on its own model, too
        ((0.02, 0.04), (0.02, -0.02), False),  # 60 ms between them
        ((0.0, 0.0), (-0.11, 0.0), False),
        ((0.0, None), (0.0, -0.08), True),  # where the model does not land, nothing is known
    ],
)
def test_executions_that_differ_by_far_more_than_allowed(
    differing: dict[str, object],
    own: tuple[float, float],
    plant: tuple[float, float],
    may: bool,
) -> None:
    differing |= {"table_replay": by(*own), "plant_replay": by(*plant)}
    assert promising(PLAN) is may  # type: ignore[arg-type]


def test_what_cannot_be_executed_may_be(
    differing: dict[str, object], monkeypatch: pytest.MonkeyPatch
) -> None:
    differing |= {"table_replay": by(0.0, 0.0), "plant_replay": None}
    assert promising(PLAN)  # type: ignore[arg-type]

    def fails(*known: object) -> None:
        raise KembaError("plant", "cannot be built")

    monkeypatch.setattr("kemba.solve.judged.plant_of", fails)
    assert promising(PLAN)  # type: ignore[arg-type]


def test_beside_a_learnt_model_the_plant_rules_nothing_out(
    differing: dict[str, object], monkeypatch: pytest.MonkeyPatch
) -> None:
    differing |= {"table_replay": by(0.0, 0.0), "plant_replay": by(-0.2, -0.1)}
    assert not promising(PLAN)  # type: ignore[arg-type]
    monkeypatch.setattr("kemba.solve.judged.truth_of", lambda task: Truth(LEARNT))
    assert promising(PLAN)  # type: ignore[arg-type]
