"""Figures of a task that nothing in it refers to."""

import pytest

from kemba.config import Document, shipped_configs
from kemba.ocp import load_task
from kemba.ocp.task.task import parse_task


@pytest.mark.parametrize("name", sorted(shipped_configs("tasks")))
def test_shipped_tasks_use_all_their_figures(name: str) -> None:
    assert load_task(name)[0].remarks == []


def test_a_height_that_no_goal_asks_for_is_told() -> None:
    task = parse_task(Document({"name": "jump", "height": "600 m", "distance": "1 m"}))
    height, distance = task.remarks
    assert height.startswith("`height` changes nothing") and "`distance`" in distance


def test_a_bound_is_enough() -> None:
    bounded = {"height": "0.5 m", "bounds": {"body/z": {"at_most": "height"}}}
    assert parse_task(Document(bounded)).remarks == []
