"""`kemba-opt sweep`: exit codes and answers. Cases are faked but in one real sweep."""

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from kemba.sweep import Case
from kemba_cli.main import app

SWEEP = """\
name: test
blocks:
  a:
    kind: solve
    task: jump.yaml
    cases: 4
    vary: {height: {low: 0.4 m, high: 0.5 m}}
"""


@pytest.fixture
def answers(monkeypatch: pytest.MonkeyPatch) -> dict[int, Any]:
    """What the fake cluster answers by the case's number; numbers taken out get no answer."""
    good = {"status": "solved", "good": True, "sentence": "solved", "solve_s": 1.0, "cost": {}}
    found: dict[int, Any] = {index: dict(good) for index in range(4)}

    def run_cases(cases: list[Case], *_: Any) -> dict[str, Any]:
        if isinstance(found.get(0), BaseException):
            raise found[0]
        return {case.key: found[case.index] for case in cases if case.index in found}

    monkeypatch.setattr("kemba.sweep.run_cases", run_cases)
    return found


@pytest.fixture
def sweep(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.chdir(tmp_path)
    Path("s.yaml").write_text(SWEEP)

    def run(*more: str) -> Result:
        return CliRunner().invoke(app, ["sweep", "s.yaml", *more])

    return run


def test_all_well(sweep: Any, answers: dict[int, Any]) -> None:
    done = sweep()
    assert done.exit_code == 0
    folder, line = done.stdout.splitlines()
    assert folder == "sweeps/test" and line.startswith("a: 4 of 4 solved (95 %: 51.0 to 100.0 %)")
    assert {p.name for p in Path(folder).iterdir()} >= {"results.csv", "results.json", "sweep.yaml"}


def test_json(sweep: Any, answers: dict[int, Any]) -> None:
    done = sweep("--json")
    answer = json.loads(done.stdout)
    assert (done.exit_code, done.stderr) == (0, "")
    assert answer["status"] == "finished" and answer["blocks"]["a"]["rate"] == 1.0


def test_failures_and_missing_cases_are_a_bad_answer(sweep: Any, answers: dict[int, Any]) -> None:
    answers[2] |= {"status": "stalled", "good": False}
    assert sweep().exit_code == 1
    assert sweep("--set", "blocks.a.expect=70 %").exit_code == 0
    del answers[1]
    limited = sweep("--set", "blocks.a.expect=0", "--json")
    assert limited.exit_code == 1 and json.loads(limited.stdout)["status"] == "limit"


def test_interruption_leaves_a_table(sweep: Any, answers: dict[int, Any]) -> None:
    answers[0] = KeyboardInterrupt()
    assert sweep().exit_code == 130
    assert "missing" in Path("sweeps/test/results.csv").read_text()


def test_bad_input(sweep: Any) -> None:
    assert sweep("--set", "blocks.a.kind=run").exit_code == 2
    assert sweep("--set", "blocks.a.vary.hight=[0.5 m]").exit_code == 2
    Path("notes.txt").touch()
    assert sweep("--out", "notes.txt").exit_code == 2


@pytest.mark.filterwarnings("ignore:unclosed:ResourceWarning")  # dask's clean-up
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_real_sweep_is_solved_and_not_repeated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two jumps on a local worker; the second time everything is there already."""
    monkeypatch.chdir(tmp_path)
    Path("s.yaml").write_text(
        SWEEP.replace("jump.yaml", "max_jump.yaml\n    set: {nodes: 24, refine: none}")
        .replace("cases: 4", "cases: 2")
        .replace("0.4 m", "0.8 m")
        .replace("0.5 m", "0.9 m")
    )
    done = CliRunner().invoke(app, ["sweep", "s.yaml", "--jobs", "1"])
    assert done.exit_code == 0, done.output
    assert done.stdout.splitlines()[1].startswith("a: 2 of 2 solved")
    kept = {p.name: p.read_bytes() for p in Path("sweeps/test/cases").iterdir()}
    cases = json.loads(Path("sweeps/test/results.json").read_text())["cases"]
    assert len(kept) == 2 and [case["status"] for case in cases] == ["solved", "solved"]
    for case in cases:
        height = float(case["values"]["height"].removesuffix(" m"))
        assert 0.8 <= height <= 0.9 and case["apex_m"] >= height - 1e-6
    again = CliRunner().invoke(app, ["sweep", "s.yaml", "--jobs", "1", "--json"])
    assert again.exit_code == 0 and json.loads(again.stdout)["good"]
    assert {p.name: p.read_bytes() for p in Path("sweeps/test/cases").iterdir()} == kept
