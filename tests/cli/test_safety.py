"""Inputs that are wrong or hostile, and places that cannot be written, are answered in words."""

import csv
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from kemba.config import Document
from kemba.files import write_json
from kemba.sweep import Case, Sweep, open_folder, write_results
from kemba_cli.main import app

COMMAND = [sys.executable, "-c", "from kemba_cli.main import main; main()"]


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def kemba(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.mark.parametrize("name", ["../../../x", "a/b", "..", "", ".hidden", "x" * 300, "a\tb"])
def test_names_lead_nowhere_else(name: str) -> None:
    spelled = json.dumps(name)
    Path("task.yaml").write_text(f"name: {spelled}\nheight: 0.4 m\n")
    Path("rig.yaml").write_text(f"rig:\n  kind: locked\n  name: {spelled}\n")
    Path("sweep.yaml").write_text(
        f"name: s\nblocks:\n  {spelled}: {{kind: solve, task: jump.yaml}}\n"
    )
    for verb in (["solve", "task.yaml", "--dry-run"], ["simulate", "rig.yaml"]):
        done = kemba(*verb)
        assert done.exit_code == 2 and "cannot name a file or folder" in done.stderr, done.stderr
    done = kemba("sweep", "sweep.yaml")
    assert done.exit_code == 2 and done.stderr
    assert sorted(p.name for p in Path().iterdir()) == ["rig.yaml", "sweep.yaml", "task.yaml"]


def test_no_content_of_other_files_is_shown() -> None:
    for name in ("secret.txt", "secret.key"):
        Path(name).write_text("key: [hidden word\n")
    Path("task.yaml").write_text("name: t\nmodel: secret.txt\nheight: 0.4 m\n")
    Path("model.yaml").write_text("base: secret.txt\n")
    for verb in (
        ["check", "task.yaml"],
        ["check", "secret.key"],  # a name ending in .txt is checked as a table
        ["solve", "task.yaml", "--dry-run"],
        ["solve", "jump.yaml", "--dry-run", "--model", "secret.txt"],
        ["solve", "jump.yaml", "--dry-run", "--model", "model.yaml"],
    ):
        done = kemba(*verb)
        assert done.exit_code == 2 and "hidden" not in done.output + done.stderr
        assert "is no YAML file; a name ending in .yaml was expected" in done.stderr


def test_a_height_that_nobody_reaches_is_refused_before_solving() -> None:
    Path("task.yaml").write_text(
        "height: 600\nmodel: planning\ngoals:\n"
        "  apex: {quantity: body/z, at: middle, equals: height}\n"
    )
    for verb in (["check", "task.yaml"], ["solve", "task.yaml", "--dry-run"]):
        done = kemba(*verb)
        assert done.exit_code == 2
        assert "cannot be met: `goals.apex` (body/z): 600 m asked, 3 m is the most" in done.stderr
    assert kemba("solve", "jump.yaml", "--dry-run", "--set", "height=600").exit_code == 2


def test_a_plain_value_for_a_goal_means_equals() -> None:
    assert kemba("solve", "jump.yaml", "--dry-run", "--set", "goals.apex=0.45 m").exit_code == 0
    done = kemba("solve", "jump.yaml", "--dry-run", "--set", "goals.apex=0.6 m")
    assert "`goals.apex` (--set goals.apex=0.6 m) asks for at least 0.6 m" in done.stderr
    done = kemba("solve", "jump.yaml", "--dry-run", "--set", "goals.apex=3 kg")
    assert done.exit_code == 2 and "is a mass" in done.stderr


def test_the_reason_of_a_failure_is_never_hidden() -> None:
    done = kemba("solve", "jump.yaml", "--set", "height=600", "-q")
    assert done.exit_code == 1
    assert "cannot be met" in done.stderr


def test_a_full_output_is_told() -> None:
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full here")
    with open("/dev/full", "w") as nowhere:
        done = subprocess.run(
            [*COMMAND, "effects", "--json"], stdout=nowhere, stderr=subprocess.PIPE, text=True
        )
    assert done.returncode == 1
    assert "the output" in done.stderr and "No space left" in done.stderr
    assert "Traceback" not in done.stderr and "unexpectedly" not in done.stderr


def test_a_user_without_home_or_name_can_work() -> None:
    code = (
        "import pwd\ndef none(*_): raise KeyError('uid not found')\npwd.getpwuid = none\n"
        "from kemba_cli.main import main; main()"
    )
    known = {k: v for k, v in os.environ.items() if k in ("PATH", "PYTHONPATH")}
    words = ["solve", "jump.yaml", "--set", "height=600", "--no-figure"]
    done = subprocess.run(
        [sys.executable, "-c", code, *words], capture_output=True, text=True, env=known
    )
    assert done.returncode == 1 and "cannot be met" in done.stderr
    assert "unexpectedly" not in done.stderr


def case() -> Case:
    return Case("a", 0, {"=1+1": "@SUM(A1)"}, "tests:none", {"x": 1})


def sweep_folder(tmp_path: Path) -> tuple[Path, Sweep]:
    asked = Sweep.model_validate({"blocks": {"a": {"kind": "solve", "task": "jump.yaml"}}})
    return open_folder(tmp_path / "out", asked, Document({})), asked


@pytest.mark.parametrize(
    "text",
    ["[1]", "null", "{}", "", '{"status": "solved', '{"status": 1, "good": true, "sentence": ""}',
     '{"status": "solved", "good": 1, "sentence": ""}', '"text"', "\x00",
     '{"status": "solved", "good": true, "sentence": "", "solve_s": "long"}',
     '{"status": "solved", "good": true, "sentence": "", "cost": 3, "apex_m": [1]}',
     '{"status": "solved", "good": true, "sentence": "", "cost": {"torque_squared_integral": []}}'],
)  # fmt: skip
def test_a_damaged_case_is_done_again(text: str, tmp_path: Path) -> None:
    folder, _ = sweep_folder(tmp_path)
    path = case().path(folder)
    path.parent.mkdir(parents=True)
    path.write_text(text)
    assert case().record(folder) is None
    good = {"status": "solved", "good": True, "sentence": "", "solve_s": 1.0, "apex_m": None}
    write_json(path, good)
    assert case().record(folder) == good


@pytest.mark.parametrize("text", ["[]", "null", "1", "", "{"])
def test_a_damaged_manifest_is_told(text: str, tmp_path: Path) -> None:
    folder, _ = sweep_folder(tmp_path)
    (folder / "manifest.json").write_text(text)
    Path("s.yaml").write_text("blocks:\n  a: {kind: solve, task: jump.yaml}\n")
    run = (
        ["report", folder],
        ["sweep", "s.yaml", "--out", folder],
        ["solve", "hop", "--out", folder],
    )
    for words in run:
        done = kemba(*words)
        assert done.exit_code == 2, done.output
        assert "is no manifest" in done.stderr or "is not valid JSON" in done.stderr


def test_damaged_certificates_are_told() -> None:
    Path("run").mkdir()
    Path("run/manifest.json").write_text('{"status": "solved"}')
    Path("run/task.yaml").write_text("height: 0.5 m\n")
    for text in ("{}", "[]", '{"status": 1, "sentence": 2, "cost": 3}'):
        Path("run/certificate.json").write_text(text)
        done = kemba("report", "run")
        assert done.exit_code == 2, done.stderr


def test_no_cell_is_a_formula(tmp_path: Path) -> None:
    folder, asked = sweep_folder(tmp_path)
    record = {"status": "error", "good": False, "sentence": "=HYPERLINK(1)"}
    write_results(folder, asked, [case()], {case().key: record}, "finished")
    table = list(csv.reader((folder / "results.csv").read_text().splitlines()))
    assert not [cell for row in table for cell in row if cell.startswith(("=", "+", "@"))]
    assert "'=HYPERLINK(1)" in table[1] and "'=1+1" in table[0]


@pytest.mark.parametrize(
    "address", ["tcp://127.0.0.1:1", "nonsense", "tcp://no-host.invalid:8786", "tcp://127.0.0.1:x"]
)
def test_a_scheduler_that_is_not_there_is_told_in_seconds(address: str) -> None:
    began = time.process_time()
    done = kemba("sweep", "reliability.yaml", "--scheduler", address)
    assert done.exit_code == 2 and f"--scheduler {address}: " in done.stderr
    assert time.process_time() - began < 10.0
    assert not Path("sweeps").exists()
