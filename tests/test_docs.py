"""The documents name what is there: keys of tasks, files of equations, shipped tasks."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from kemba.config import shipped_configs
from kemba.ocp.task.costs import COSTS
from kemba.ocp.task.task import Bound, Goal, Solver, Task, Tolerances

ROOT = Path(__file__).parent.parent
PAGES = sorted([*ROOT.glob("docs/*.md"), ROOT / "README.md"])


@pytest.mark.parametrize("section", [Task, Solver, Tolerances, Goal, Bound])
def test_every_key_of_a_task_is_described(section: type[Task]) -> None:
    page = (ROOT / "docs" / "tasks.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`(\w+)`", page))
    assert set(section.model_fields) <= named


def test_every_cost_and_shipped_task_is_described() -> None:
    page = (ROOT / "docs" / "tasks.md").read_text(encoding="utf-8")
    assert all(f"| `{name}` |" in page for name in (*COSTS, *shipped_configs("tasks")))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_files_that_are_named_exist(page: Path) -> None:
    for name in re.findall(r"`((?:kemba|configs|docs|tests)/[\w/.]+)`", page.read_text("utf-8")):
        assert (ROOT / name).exists(), f"{page.name}: {name}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    for link in re.findall(r"\]\(([^)#:]+)(?:#[\w-]+)?\)", page.read_text("utf-8")):
        assert (page.parent / link).exists(), f"{page.name}: {link}"


def test_every_page_stands_in_the_navigation() -> None:
    nav = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    assert all(f": {page.name}\n" in nav for page in ROOT.glob("docs/*.md"))
