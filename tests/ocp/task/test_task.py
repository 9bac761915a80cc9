"""What the keys of a task do to each other."""

from pathlib import Path

import pytest

from kemba.errors import KembaError
from kemba.ocp import load_task
from kemba.ocp.task.task import Tolerances


def test_the_last_of_height_and_feet_counts() -> None:
    """An option replaces the other key of the file; two options contradict each other."""
    assert load_task("jump.yaml")[0].height is not None
    task, _ = load_task("jump.yaml", ["feet=0.1 m"])
    assert (task.height, task.feet) == (None, 0.1)
    with pytest.raises(KembaError, match="'feet' does not go with 'height'"):
        load_task("jump.yaml", ["feet=0.1 m", "height=0.5 m"])


def test_during_goes_forwards() -> None:
    goal = "goals.apex.during=[{}, {}]"
    with pytest.raises(KembaError, match="goes from an earlier to a later part"):
        load_task("jump.yaml", [goal.format(0.7, 0.4), "goals.apex.at=null"])


def test_a_table_may_miss_by_what_the_page_says() -> None:
    page = (Path(__file__).parents[3] / "docs" / "tasks.md").read_text(encoding="utf-8")
    t = Tolerances()
    apex, touchdown, final = 1e3 * t.table_apex, 1e3 * t.table_touchdown, 1e2 * t.table_final
    told = f"`table_final` | {apex:g} mm, {touchdown:g} ms, {final:g} cm |"
    assert told in page
