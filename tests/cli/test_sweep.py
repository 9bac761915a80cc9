"""`kemba-opt sweep`: exit codes and answers; results of earlier runs are continued."""

import json
import signal
import subprocess
import sys
import time
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import psutil
import pytest
from typer.testing import CliRunner, Result

from kemba.files import write_json
from kemba.sweep import expand, load_sweep, open_folder
from kemba_cli.main import app

SWEEP = """\
name: test
blocks:
  a:
    kind: solve
    task: jump.yaml
    set: {nodes: 800, refine: none}
    cases: 4
    vary: {height: {low: 0.4 m, high: 0.5 m}}
"""
GOOD = {"status": "solved", "good": True, "sentence": "solved", "solve_s": 1.0, "cost": {}}
FOLDER = Path("sweeps/test")

# dask's own clean-up of a cluster that was just closed
pytestmark = [
    pytest.mark.filterwarnings("ignore:unclosed:ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


@pytest.fixture
def sweep(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.chdir(tmp_path)
    Path("s.yaml").write_text(SWEEP)

    def run(*more: str) -> Result:
        return CliRunner().invoke(app, ["sweep", "s.yaml", "--jobs", "1", *more])

    return run


@pytest.fixture
def done_before(sweep: Any) -> list[Path]:
    """The files of four cases that an earlier run of the same sweep has solved."""
    asked, document = load_sweep("s.yaml")
    cases = expand(asked, document, open_folder(None, asked, document))
    for case in cases:
        write_json(case.path(FOLDER), GOOD)
    return [case.path(FOLDER) for case in cases]


def test_all_well(sweep: Any, done_before: list[Path]) -> None:
    done = sweep()
    assert done.exit_code == 0
    folder, line = done.stdout.splitlines()
    assert folder == "sweeps/test" and line.startswith("a: 4 of 4 solved (95 %: 51.0 to 100.0 %)")
    assert {p.name for p in Path(folder).iterdir()} >= {"results.csv", "results.json", "sweep.yaml"}


def test_json(sweep: Any, done_before: list[Path]) -> None:
    done = sweep("--json")
    answer = json.loads(done.stdout)
    assert (done.exit_code, done.stderr) == (0, "")
    assert answer["status"] == "finished" and answer["blocks"]["a"]["rate"] == 1.0


def test_failures_are_a_bad_answer(sweep: Any, done_before: list[Path]) -> None:
    write_json(done_before[2], {**GOOD, "status": "stalled", "good": False})
    assert sweep().exit_code == 1
    assert sweep("--set", "blocks.a.expect=70 %").exit_code == 0


def test_missing_cases_are_a_bad_answer(sweep: Any, done_before: list[Path]) -> None:
    done_before[1].unlink()
    limited = sweep("--time-limit", "0.1", "--set", "blocks.a.expect=0", "--json")
    assert limited.exit_code == 1 and json.loads(limited.stdout)["status"] == "limit"


@pytest.mark.slow
def test_interruption_leaves_a_table(sweep: Any, done_before: list[Path]) -> None:
    done_before[1].unlink()
    command = [sys.executable, "-c", "from kemba_cli.main import main; main()"]
    command += ["sweep", "s.yaml", "--jobs", "1", "-q"]
    # tests that run in the background of a shell ignore this signal, and so do their children
    usual = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    with subprocess.Popen(command, preexec_fn=usual) as client:
        deadline = time.monotonic() + 120
        while not _works(client.pid):
            assert client.poll() is None and time.monotonic() < deadline
            time.sleep(0.05)
        client.send_signal(signal.SIGINT)
        assert client.wait(60) == 130
    rows = (FOLDER / "results.csv").read_text().splitlines()
    assert sum("missing" in row for row in rows) == 1 and sum("solved" in row for row in rows) == 3


def _works(pid: int) -> bool:
    """Whether a worker of a client has begun its case: importing alone takes less time."""
    with suppress(psutil.NoSuchProcess):
        for process in psutil.Process(pid).children(True):
            if "spawn_main" in " ".join(process.cmdline()) and process.cpu_times().user > 4.0:
                return True
    return False


def test_bad_input(sweep: Any) -> None:
    assert sweep("--set", "blocks.a.kind=run").exit_code == 2
    assert sweep("--set", "blocks.a.vary.hight=[0.5 m]").exit_code == 2
    Path("notes.txt").touch()
    assert sweep("--out", "notes.txt").exit_code == 2


@pytest.mark.slow
def test_a_real_sweep_is_solved_and_not_repeated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two jumps on a local worker; the second time everything is there already."""
    monkeypatch.chdir(tmp_path)
    Path("s.yaml").write_text(
        SWEEP.replace("nodes: 800, refine: none", "nodes: 100")
        .replace("cases: 4", "cases: 2")
        .replace("0.4 m", "0.5 m")
        .replace("0.5 m}", "0.52 m}")
    )
    done = CliRunner().invoke(app, ["sweep", "s.yaml", "--jobs", "1"])
    assert done.exit_code == 0, done.output
    assert done.stdout.splitlines()[1].startswith("a: 2 of 2 solved")
    kept = {p.name: p.read_bytes() for p in Path("sweeps/test/cases").iterdir()}
    cases = json.loads(Path("sweeps/test/results.json").read_text())["cases"]
    assert len(kept) == 2 and [case["status"] for case in cases] == ["solved", "solved"]
    for case in cases:
        height = float(case["values"]["height"].removesuffix(" m"))
        assert 0.5 <= height <= 0.52 and case["apex_m"] == pytest.approx(height, abs=1e-3)
        assert case["start"].startswith("guess") and case["refined"] and case["replays"]
    again = CliRunner().invoke(app, ["sweep", "s.yaml", "--jobs", "1", "--json"])
    assert again.exit_code == 0 and json.loads(again.stdout)["good"]
    assert {p.name: p.read_bytes() for p in Path("sweeps/test/cases").iterdir()} == kept
