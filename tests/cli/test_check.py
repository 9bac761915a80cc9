"""`kemba-opt check` and `schema`, as scripts see them."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from kemba_cli.main import app

BAD_MODEL = """\
name: mine
supply: 7 kg
robbot: kemba
effects:
  - kind: motr
  - {kind: contact, mu: 1 m}
"""

EXPLAINED = """\
mine.yaml:2:1: supply: '7 kg' is a mass; a pressure such as '7 bar' was expected
    supply: 7 kg
    ^
mine.yaml:3:1: robbot: unknown key; did you mean 'robot'?
    robbot: kemba
    ^
mine.yaml:5:5: effects[0].kind: unknown kind 'motr'; did you mean 'motor'?
      - kind: motr
        ^
mine.yaml:6:21: effects[1].mu: '1 m' is a length; a number such as '0.5' was expected
      - {kind: contact, mu: 1 m}
                        ^
"""


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def run(*words: str) -> Result:
    return CliRunner().invoke(app, list(words))


def test_a_bad_model_is_explained_on_stderr() -> None:
    Path("mine.yaml").write_text(BAD_MODEL)
    done = run("check", "mine.yaml")
    assert (done.exit_code, done.stdout, done.stderr) == (2, "", EXPLAINED)


def test_all_files_are_checked() -> None:
    Path("air.csv").write_text("time [s],air/T [K]\n0,290\n0.5,291\n")
    Path("bad.csv").write_text("time [s],body/z [m]\n0,high\n")
    done = run("check", "bad.csv", "air.csv", "kemba.yaml")
    assert done.exit_code == 2
    assert done.stderr == "bad.csv:2:2: body/z [m]: 'high' is not a number\n"
    assert done.stdout == (
        "air.csv: valid table: 2 rows, 1 columns, 0.5 s\nkemba.yaml: valid robot file\n"
    )


def test_column_maps_are_checked() -> None:
    assert run("check", "authors.yaml").stdout == "authors.yaml: valid column map\n"
    Path("map.yaml").write_text(
        "columns:\n  time [s]: {source: t, scal: 2}\n  x [m]: {source: x}\n"
    )
    done = run("check", "map.yaml")
    assert done.exit_code == 2
    assert "map.yaml:2:25: columns.time [s].scal: unknown key" in done.stderr
    Path("map.yaml").write_text("columns:\n  x [m]: {source: x}\n  y [m]: {source: y}\n")
    assert "'time [s]' is not mapped" in run("check", "map.yaml").stderr


def test_a_plan_is_a_table_and_no_log() -> None:
    """It has no torques, say, and nobody will compare it."""
    Path("plan.csv").write_text("time [s],body/z [m]\n0,0.2\n0.5,0.3\n")
    assert "plan.csv: needs the column 'body/x'" in run("check", "plan.csv").stderr
    Path("manifest.json").write_text("{}")
    assert run("check", "plan.csv").stdout == "plan.csv: valid table: 2 rows, 1 columns, 0.5 s\n"


def test_json_is_one_object() -> None:
    done = run("check", "kemba.yaml", "none.yaml", "--json")
    answer = json.loads(done.stdout)
    assert done.exit_code == 2
    assert [file["good"] for file in answer["files"]] == [True, False]


def test_files_of_no_known_kind() -> None:
    Path("x.yaml").write_text("colour: red\n")
    done = run("check", "x.yaml")
    assert done.exit_code == 2
    assert done.stderr.startswith("x.yaml: is no kind of file that kemba knows; keys of one of")


def test_a_file_with_keys_of_two_kinds() -> None:
    """As of someone who expects that tasks are based on others, like models."""
    Path("x.yaml").write_text("base: jump.yaml\nheight: 0.6 m\n")
    told = run("check", "x.yaml").stderr
    assert "x.yaml:2:1: height: unknown key" in told
    assert "x.yaml: was checked as a model file, but has keys of a task file; a file of" in told


def test_schemas_for_editors() -> None:
    assert "body" in json.loads(run("schema", "robots").stdout)["properties"]
    assert run("schema", "robos").stderr == (
        "robos: no such kind of file; did you mean 'robots'?\n"
    )
    assert run("schema", "--out", "schemas").exit_code == 0
    assert json.loads(Path("schemas/models.schema.json").read_text())["title"] == "ModelSpec"
    again = run("schema", "--out", "schemas")
    assert again.exit_code == 2 and "exists already; give another name, or --force" in again.stderr
    assert run("schema", "--out", "schemas", "--force").exit_code == 0
