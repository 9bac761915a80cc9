"""Plans that the user has made start further ones; nothing depends on them."""

import json
import math
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from kemba.ocp import load_task, task_model
from kemba.solve.memory import (
    NAME,
    NEAR,
    best_known,
    distance,
    figures_of,
    kind_of,
    list_file,
    recalled,
)
from kemba_cli.main import app


def solve(folder: Path, *words: str) -> dict[str, Any]:
    fixed = ["--no-figure", "--json", "--out", str(folder)]
    return dict(json.loads(CliRunner().invoke(app, ["solve", *words, *fixed]).stdout))


@pytest.fixture
def listed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("KEMBA_MEMORY", str(tmp_path))
    return tmp_path / NAME


def test_a_near_task_begins_from_the_users_plan(tmp_path: Path, listed: Path) -> None:
    first = solve(tmp_path / "first", "jump.yaml")
    assert first["good"] and first["start"] == "guess" and first["best_known"] is None
    near = solve(tmp_path / "near", "jump.yaml", "--set", "height=0.52 m")
    assert near["good"] and near["start"] == f"run: {tmp_path / 'first'}" and near["continued"]
    assert near["iterations"] < first["iterations"] / 2
    again = solve(tmp_path / "again", "jump.yaml", "--no-memory")
    assert again["start"] == "guess" and again["best_known"] is None
    assert len(listed.read_text().splitlines()) == 2, "not that without memory"


def test_damaged_entries_and_runs_that_are_gone_are_left_out(tmp_path: Path, listed: Path) -> None:
    task, _ = load_task("hop.yaml")
    model = task_model(task)
    entry = {"kind": kind_of(task, model), "figures": figures_of(task, model), "cost": 0.5}
    gone = json.dumps({**entry, "run": str(tmp_path / "gone")})
    listed.write_text(f"{gone}\n[]\n{{\n")
    told: list[str] = []
    assert recalled(task, model, told.append) is None
    assert told == [f"2 entries of {listed} cannot be read and are left out"]
    assert best_known(task, model, told.append) == {"cost": 0.5, "of": 1}
    listed.write_bytes(b"\xff")
    assert recalled(task, model, told.append) is None
    assert "cannot be read and is left out" in told[-1]


ODD = {
    "cost": [None, "x", [], math.nan, -math.inf, 10**400],
    "figures": [None, [], {"height": math.inf}, {"height": 10**400}, {"height": {}}],
    "run": ["a" * 10**4, "\0", "/dev/null", "../..", 10**400],
}


def test_entries_of_others_are_data(tmp_path: Path, listed: Path) -> None:
    """Whatever stands in them, plans begin from guesses, no cost is believed that is no number, and
    what cannot be read is said."""
    task, _ = load_task("hop.yaml")
    model = task_model(task)
    entry = {"kind": kind_of(task, model), "figures": figures_of(task, model), "cost": 0.5}
    entry["run"] = str(tmp_path / "gone")
    for key, values in ODD.items():
        for value in values:
            told: list[str] = []
            listed.write_text(json.dumps({**entry, key: value}) + "\n" + "[" * 10**5 + "\n")
            assert recalled(task, model, told.append) is None
            known = best_known(task, model, told.append)
            assert known == ({"cost": 0.5, "of": 1} if key == "run" else None), (key, str(value))
            count = 1 if key == "run" else 2
            said = f"{count} entries of {listed} cannot be read and are left out"
            assert told == [said, said], (key, str(value))


def test_without_a_folder_nothing_is_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KEMBA_MEMORY", "")
    assert list_file() is None
    monkeypatch.delenv("KEMBA_MEMORY")
    monkeypatch.setenv("XDG_DATA_HOME", "/somewhere")
    assert list_file() == Path("/somewhere/kemba") / NAME


@pytest.mark.parametrize(
    ("change", "near"),
    [
        ("height=0.53 m", True),
        ("supply=0.75 MPa", True),
        ("payload=0.4 kg", True),
        ("grip=0.5", True),
        ("nodes=60", True),
        ("height=0.7 m", False),
        ("payload=3 kg", False),
        ("bounds.body/pitch={at_most: 5 deg}", False),
        ("cost.air=0.4", False),
        ("effects.contact.mu=0.5", False),
    ],
)
def test_what_is_near(change: str, near: bool) -> None:
    tasks = [load_task("jump.yaml", words)[0] for words in ([], [change])]
    models = [task_model(task) for task in tasks]
    kinds = {kind_of(task, model) for task, model in zip(tasks, models, strict=True)}
    figures = [figures_of(task, model) for task, model in zip(tasks, models, strict=True)]
    assert (len(kinds) == 1 and distance(models[0], *figures) <= NEAR) == near
