"""The documents name what is there: keys of tasks, files of equations, shipped tasks."""

import pkgutil
import re
import runpy
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from kemba.config import shipped_configs
from kemba.mechanism.cylinder import CylinderTable
from kemba.mechanism.links import Leg, LegPlace, Link, LinkTolerances, Piston, RobotFile
from kemba.model import load_model
from kemba.ocp.task.costs import COSTS
from kemba.ocp.task.task import Bound, Goal, Solver, Task, Tolerances
from kemba_cli.main import app

ROOT = Path(__file__).parent.parent
RECORDS = sorted(ROOT.glob("benchmarks/pages/*.md"))
PAGES = sorted([*ROOT.glob("docs/*.md"), *RECORDS, ROOT / "README.md"])


@pytest.mark.parametrize("section", [Task, Solver, Tolerances, Goal, Bound])
def test_every_key_of_a_task_is_described(section: type[Task]) -> None:
    page = (ROOT / "docs" / "tasks.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`(\w+)`", page))
    assert {field.alias or name for name, field in section.model_fields.items()} <= named


def test_the_site_lists_the_keys_of_a_task_from_the_schema() -> None:
    """As a table that is made when the site is built."""
    table = runpy.run_path(str(ROOT / "docs/hooks.py"))["task_keys"]()
    assert "| `hold` | before plan time 0 [s], minimum 0, maximum 10 | `0.0` |" in table
    assert '| `guess` | `automatic`, `standing` | `"automatic"` |' in table
    assert "| `feet` | of the feet at the top [m], minimum 0 |  |" in table
    for part, section in (("", Task), ("solver.", Solver), ("tolerances.", Tolerances)):
        fields = section.model_fields.items()
        assert all(f"| `{part}{field.alias or name}` |" in table for name, field in fields)


SECTIONS: dict[str, type[Any]] = {
    "Robot": RobotFile,
    "Place of a leg": LegPlace,
    "Leg": Leg,
    "Link": Link,
    "Lengths of the piston": Piston,
    "Tolerances of the links": LinkTolerances,
    "Cylinder": CylinderTable,
}


@pytest.mark.parametrize("title", SECTIONS)
def test_every_key_of_a_robot_is_described_with_its_unit(title: str) -> None:
    page = (ROOT / "docs" / "robots.md").read_text(encoding="utf-8")
    section = page.split(f"### {title}\n")[1].split("\n##")[0]
    told = dict(re.findall(r"^\| `(\w+)` \| ([^|]+) \|", section, re.MULTILINE))
    fields = SECTIONS[title].model_fields
    assert list(told) == list(fields)
    for name, info in fields.items():
        unit = re.search(r"Param\(unit='([^']+)'", f"{info.metadata}{info.annotation}")
        assert unit is None or told[name] == unit.group(1), name


def test_the_walk_of_the_robots_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its first three steps, by a shell; nothing is solved."""
    page = (ROOT / "docs" / "robots.md").read_text(encoding="utf-8")
    shell = re.findall(r"```sh\n(.*?)```", page, re.DOTALL)
    model = re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)[0]
    first = shell[0].replace("python -c", f"{sys.executable} -c")
    subprocess.run(["sh", "-ec", first], cwd=tmp_path, check=True)
    (tmp_path / "mine" / "model.yaml").write_text(model, encoding="utf-8")
    monkeypatch.chdir(tmp_path / "mine")
    for line in shell[1].strip().splitlines():
        verb = [*shlex.split(line)[1:], *(["--dry-run"] if " solve " in line else [])]
        done = CliRunner().invoke(app, verb)
        assert done.exit_code == 0, done.output
    assert load_model("model.yaml").mechanism.legs == ("left", "right")


def test_every_cost_and_shipped_task_is_described() -> None:
    page = (ROOT / "docs" / "tasks.md").read_text(encoding="utf-8")
    assert all(f"| `{name}` |" in page for name in (*COSTS, *shipped_configs("tasks")))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_files_that_are_named_exist(page: Path) -> None:
    for name in re.findall(r"`((?:kemba|configs|docs|tests)/[\w/.]+)`", page.read_text("utf-8")):
        assert (ROOT / name).exists(), f"{page.name}: {name}"


def test_pages_that_the_code_names_exist() -> None:
    for file in [*(ROOT / "kemba").rglob("*.py"), *(ROOT / "cli").rglob("*.py")]:
        for page in re.findall(r"docs/[\w-]+\.md", file.read_text("utf-8")):
            assert (ROOT / page).exists(), f"{file.name}: {page}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    for link in re.findall(r"\]\(([^)#:]+)(?:#[\w-]+)?\)", page.read_text("utf-8")):
        assert (page.parent / link).exists(), f"{page.name}: {link}"


def test_what_the_reference_takes_from_the_code_is_there() -> None:
    for page in PAGES:
        for name in re.findall(r"^::: ([\w.]+)$", page.read_text("utf-8"), re.MULTILINE):
            assert pkgutil.resolve_name(name), f"{page.name}: {name}"


def test_every_page_has_a_way_onwards() -> None:
    """Its last line says where to go next; of pages that scripts write the site adds it."""
    added = runpy.run_path(str(ROOT / "docs/hooks.py"))["NEXT"]
    own = {p.name for p in ROOT.glob("docs/*.md") if p.name not in (*added, "index.md")}
    for name in own:
        last = (ROOT / "docs" / name).read_text(encoding="utf-8").rstrip().split("\n\n")[-1]
        assert last.startswith("Next: ") and re.search(r"\]\([\w-]+\.md", last), name
    for name, line in added.items():
        links = re.findall(r"\]\(([\w-]+\.md)\)", line)
        assert links and all((ROOT / "docs" / link).is_file() for link in links), name
        assert name == "cli.md" or (ROOT / "docs" / name).is_file()


def test_every_page_stands_in_the_navigation() -> None:
    nav = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    assert all(f": {page.name}\n" in nav for page in ROOT.glob("docs/*.md"))
