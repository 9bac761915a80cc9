"""Moments of a task: names, shares, and the events of its contacts."""

import pytest

from kemba.ocp.task.moments import events_of, share_of, spans
from kemba.ocp.task.task import Task

BOUND = Task.model_validate(
    {"contacts": ["air", "rear", "air", {"on": "front", "share": 0.4}, "air"]}
)


def test_parts_without_a_share_share_the_rest() -> None:
    borders = [begin for begin, _ in spans(BOUND.contacts)]
    assert borders == pytest.approx([0.0, 0.15, 0.3, 0.45, 0.85])


def test_events_are_at_the_borders_of_parts() -> None:
    found = events_of(BOUND.contacts)
    assert found["touchdown rear"] == found["touchdown"] == pytest.approx(0.15)
    assert found["liftoff rear"] == found["liftoff"] == pytest.approx(0.3)
    assert found["touchdown front"] == pytest.approx(0.45)
    twice = Task.model_validate({"contacts": ["rear", "air", "rear", "air"]})
    assert events_of(twice.contacts)["liftoff rear 2"] == pytest.approx(0.75)


def test_moments_are_shares_of_the_nodes() -> None:
    named = [share_of(moment, BOUND) for moment in ("start", "middle", "end", 0.3, "30 %")]
    assert named == pytest.approx([0.0, 0.5, 1.0, 0.3, 0.3])
    assert share_of("liftoff front", BOUND) == pytest.approx(0.85)


@pytest.mark.parametrize(
    ("moment", "said"),
    [
        ("midle", "did you mean 'middle'"),
        ("touchdown frnt", "did you mean 'touchdown front'"),
        ("130 %", "0 % to 100 % was expected"),
        ("touchdown rear 2", "`contacts` have no"),
    ],
)
def test_a_moment_that_is_not_there_is_told(moment: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        share_of(moment, BOUND)


def test_events_need_contacts() -> None:
    with pytest.raises(ValueError, match="which the task does not give"):
        share_of("touchdown front", Task())


def test_shares_add_up_to_the_motion() -> None:
    with pytest.raises(ValueError, match="100 % was expected"):
        spans(Task.model_validate({"contacts": [{"on": "air", "share": 0.4}]}).contacts)
