"""Interrupts, time limits, and going on from what they leave."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ocp.runs import solved
from typer.testing import CliRunner, Result

from kemba.ocp import load_task, plan, task_model
from kemba.ocp.nlp.interrupt import Interrupt
from kemba.ocp.relaxation.schedule import node_groups, resumed
from kemba.ocp.task.resolve import resolve
from kemba.ocp.transcription.symmetry import whole
from kemba.ocp.transcription.transcribe import Transcription
from kemba.runs import load_run
from kemba_cli.main import app

FILES = ("trajectory.csv", "controller.csv", "certificate.json")
posix = pytest.mark.skipif(os.name != "posix", reason="sends SIGINT")


def solve(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["solve", "--no-figure", "--no-replay", "--cold", *arguments])


def started(folder: Path, *arguments: str) -> subprocess.Popen[str]:
    """`kemba-opt solve` in a process of its own."""
    code = "from kemba_cli.main import main; main()"
    command = [sys.executable, "-u", "-c", code, "solve", "jump", "--no-figure", "--cold"]
    command += ["--out", str(folder), *arguments]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=folder.parent
    )


def wait_for(process: subprocess.Popen[str], words: str) -> None:
    """Read the process's talk until it says `words`."""
    assert process.stderr is not None
    for line in process.stderr:
        if words in line:
            return
    pytest.fail(f"never said {words}")


@posix
@pytest.mark.parametrize(
    ("moment", "delay", "nodes"), [("relax", 0.0, 60), ("relax", 0.3, 200), ("tighten", 0.0, 60)]
)
def test_interrupt_keeps_the_best_iterate(
    moment: str, delay: float, nodes: int, tmp_path: Path
) -> None:
    process = started(tmp_path / "run", "--set", f"nodes={nodes}", "--set", "solver.coarse=false")
    wait_for(process, moment)
    time.sleep(delay)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    assert process.returncode == 130
    run = load_run(tmp_path / "run")
    assert run.manifest["status"] == "interrupted"
    assert all((run.path / name).is_file() for name in FILES)
    assert run.certificate["status"] == "interrupted"
    assert len(run.trajectory) > 20 and np.isfinite(run.trajectory["body/z"]).all()


@posix
def test_second_interrupt_quits_at_once(tmp_path: Path) -> None:
    process = started(tmp_path / "run", "--set", "nodes=400", "--set", "solver.coarse=false")
    wait_for(process, "relax")
    process.send_signal(signal.SIGINT)
    time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=30)
    assert process.returncode == -signal.SIGINT


@posix
def test_interrupt_outside_the_solver() -> None:
    """Python code is not torn apart: the flag is seen at the next solve."""
    task, document = load_task("jump", ["nodes=24"])
    told: list[str] = []
    with Interrupt(told.append) as stop:
        os.kill(os.getpid(), signal.SIGINT)
        found = plan(task, document, stop=stop)
    assert found.status == "interrupted" and found.iterations == 0
    assert len(told) == 1


def test_interrupt_leaves_other_threads_alone() -> None:
    before = signal.getsignal(signal.SIGINT)

    def work() -> None:
        with Interrupt() as stop:
            assert not stop()
            assert signal.getsignal(signal.SIGINT) is before

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert signal.getsignal(signal.SIGINT) is before


def answered(result: Result) -> dict[str, Any]:
    return dict(json.loads(result.stdout))


def test_time_limit_keeps_the_best_iterate_and_resume_finishes(tmp_path: Path) -> None:
    first = tmp_path / "first"
    done = solve("jump", "--set", "nodes=30", "--time-limit", "0.2", "--out", str(first))
    assert done.exit_code == 1
    run = load_run(first)
    assert run.manifest["status"] == "limit"
    assert all((first / name).is_file() for name in FILES)
    limit = "--set", "solver.time_limit=300 s"
    again = solve("--resume", str(first), *limit, "--json", "--out", str(tmp_path / "second"))
    assert again.exit_code == 0
    answer = answered(again)
    assert answer["status"] == "solved" and answer["task"] == "jump"
    assert load_run(first).manifest["status"] == "limit"


def test_resume_a_solved_run_with_a_change(tmp_path: Path) -> None:
    before = solved("jump").run
    change = ("--set", "height=0.52 m", "--set", "nodes=40", "--json")
    done = solve("--resume", str(before.path), *change, "--out", str(tmp_path / "run"))
    assert done.exit_code == 0
    answer = answered(done)
    assert answer["apex_m"] == pytest.approx(0.52, abs=1e-4)
    assert "relax" not in {a["name"] for a in answer["attempts"]}, "a warm start needs no guess"


def test_resume_in_the_folder_of_a_killed_run(tmp_path: Path) -> None:
    folder = tmp_path / "killed"
    assert solve("jump", "--set", "nodes=40", "--out", str(folder)).exit_code == 0
    manifest = json.loads((folder / "manifest.json").read_text())
    (folder / "manifest.json").write_text(json.dumps({**manifest, "status": "running"}))
    for name in FILES:
        (folder / name).unlink()
    done = solve("--resume", str(folder))
    assert (done.exit_code, done.stdout.strip()) == (0, str(folder))
    assert load_run(folder).manifest["status"] == "solved"


def test_resume_needs_a_run(tmp_path: Path) -> None:
    done = solve("--resume", str(tmp_path))
    assert done.exit_code == 2 and "is not a run folder" in done.stderr


def test_a_task_is_needed() -> None:
    assert solve().exit_code == 2


def test_trajectory_to_program_and_back() -> None:
    run = solved("jump").run
    task, document = load_task(run.task)
    model = task_model(task)
    requirements = resolve(task, model, document)
    program = Transcription(model, task, requirements, whole(model.node), task.nodes)
    Y = resumed(program, run.trajectory).Y
    groups = node_groups(model, run.trajectory)
    assert len(groups["h"]) == len(run.trajectory)
    for name in ("q", "v", "s"):
        assert program.layout.full(Y, name) == pytest.approx(groups[name], abs=1e-6)
    finer = Transcription(
        model, task, requirements, whole(model.node), 2 * (len(run.trajectory) - 1)
    )
    fine = resumed(finer, run.trajectory).Y
    assert program.layout.full(fine[::2], "q") == pytest.approx(groups["q"], abs=1e-6)
    assert finer.times(fine)[-1] == pytest.approx(run.trajectory.time[-1], rel=0.03)
