"""The worked examples of the documents: their commands run, and find what the pages say."""

import json
import re
import shlex
from pathlib import Path

import pytest
from paper_tables import published
from typer.testing import CliRunner

from kemba_cli.main import app

ROOT = Path(__file__).parents[2]


TABLES, FOREIGN = (
    (ROOT / "benchmarks" / "pages" / "examples.md")
    .read_text(encoding="utf-8")
    .split("\n## Example: ")
)


def commands(text: str) -> list[list[str]]:
    """Arguments of every kemba-opt call of an example, in order."""
    return [shlex.split(line) for line in re.findall(r"^\$ kemba-opt (.+)$", text, re.MULTILINE)]


def run(arguments: list[str]) -> str:
    found = CliRunner().invoke(app, arguments)
    assert found.exit_code == 0, found.output
    return found.stdout


def test_the_tables_tell_of_friction_supply_and_tubes() -> None:
    found = published()
    assert found.sentence in TABLES
    for mode, losses in found.losses.items():
        assert f"| {mode} | {' | '.join(f'{loss:.1f}' for loss in losses)} |" in TABLES
    for arguments in commands(TABLES):
        assert arguments[-1] in run(arguments)


@pytest.fixture
def at_home(authors_plan: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The folder in which the page's file lies, with its sidecar."""
    monkeypatch.chdir(authors_plan.parent)


@pytest.mark.nightly
@pytest.mark.usefixtures("at_home")
def test_a_foreign_plan_lacks_the_weight_of_the_boom() -> None:
    compare, discover, adopt = commands(FOREIGN)
    cells = json.loads(run([*compare, "--json"]))["cells"]
    worst = max(
        (c for c in cells if c["phase"] == "flight" and c["mode"] == "00"), key=lambda c: c["ratio"]
    )
    assert worst["channel"] == "body/z" and worst["ratio"] > 10 and worst["q_value"] < 1e-6

    answer = json.loads(run([*discover, "--json"]))
    assert answer["verdict"] == "partly" and "boom_force" in answer["added"]
    (force,) = [r["parameters"]["F"] for r in answer["ranking"] if r["effect"] == "boom_force"]
    assert force["low"] < 12.2 < force["high"] and force["high"] - force["low"] < 4.0
    assert not {"boom_spring", "chambers:orifice", "rotor_inertia"} & set(answer["added"])
    assert answer["error_after"] < 0.6 * answer["error_before"]

    run(adopt)
    assert "boom_force" in Path("with_boom_force.yaml").read_text(encoding="utf-8")
