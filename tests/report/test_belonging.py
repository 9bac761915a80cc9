"""Logs that are not those of the run are told, on the page and on the command line."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from kemba.report.review import doubt, other_commands, own_run, strangers
from kemba.runs import Run, load_run
from kemba.trajectory import Trajectory
from kemba_cli.main import app


@pytest.fixture(scope="module")
def another(jump: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of which the valves stay open for 6 ms longer; its log holds no commands."""
    run = tmp_path_factory.mktemp("runs") / "other"
    shutil.copytree(jump, run)
    table = Trajectory.read(run / "controller.csv")
    longer = {
        header: np.maximum(table[name], np.roll(table[name], 6))
        for header, name in zip(table.headers, table.names, strict=True)
        if "/valve/" in name
    }
    table.with_columns(longer).write(run / "controller.csv")
    return run


def logs_of(run: Path) -> list[Trajectory]:
    found = [Trajectory.read(path) for path in sorted((run / "logs").glob("*.csv"))]
    for number, log in enumerate(found, 1):
        log.meta["name"] = f"log-{number}"
    return found


def test_logs_of_a_run_belong_to_it_whenever_they_begin(jump: Path) -> None:
    run = load_run(jump)
    late = [Trajectory(t.time + 5.0, dict(zip(t.headers, map(t.__getitem__, t.names), strict=True)),
                       t.meta) for t in logs_of(jump)]  # fmt: skip
    slow = [Trajectory(t.time[::5], {h: t[n][::5] for h, n in zip(t.headers, t.names, strict=True)},
                       t.meta) for t in logs_of(jump)]  # fmt: skip
    for logs in (logs_of(jump), late, slow):
        assert strangers(run, logs) == []
        assert all((other_commands(log, run.controller) or 0.0) < 0.005 for log in logs)


def test_other_commands_are_told_with_their_share(jump: Path, another: Path) -> None:
    run, logs = load_run(another), logs_of(jump)
    found = strangers(run, logs)
    assert [one.name for one in found] == ["log-1", "log-2"]
    share = other_commands(logs[0], run.controller)
    assert share is not None and 0.02 < share < 0.2
    said = doubt(found, run)
    assert said.startswith(
        f"log-1 and log-2 do not belong to {another}; of each: its valve commands "
    )
    assert "% of the time in which valves are open; it was made of" in said
    assert said.endswith("it was made of the run jump-1.")
    assert own_run(found, run) is None  # it does not stand beside this one


def test_feedback_may_move_edges(another: Path, jump: Path, tmp_path: Path) -> None:
    run = tmp_path / "other"
    shutil.copytree(another, run)
    (run / "policy.npz").touch()
    assert strangers(load_run(run), logs_of(jump)) == []


def test_without_commands_the_sidecar_tells(jump: Path, tmp_path: Path) -> None:
    run = load_run(jump)
    bare = [
        Trajectory(t.time, {h: t[n] for h, n in zip(t.headers, t.names, strict=True)
                            if "/valve/" not in n}, t.meta)
        for t in logs_of(jump)
    ]  # fmt: skip
    assert strangers(run, bare) == []
    renamed = Run(tmp_path / "jump-7", run.manifest)
    shutil.copytree(jump, renamed.path)
    found = strangers(renamed, bare[:1])
    assert doubt(found, renamed).endswith("jump-7: it was made of the run jump-1.")
    shutil.copytree(jump, tmp_path / "jump-1")
    assert own_run(found, renamed) == tmp_path / "jump-1"
    assert strangers(renamed, logs_of(jump)) == []  # the commands are those of this run


def test_other_robots_and_rigs_are_told(jump: Path) -> None:
    run, log = load_run(jump), logs_of(jump)[0]
    renamed = {h.replace("front/", "left/"): log[n] for h, n in zip(log.headers, log.names)}  # noqa: B905
    found = strangers(run, [Trajectory(log.time, renamed, log.meta)])
    assert found[0].why == "its legs are left, rear, those of the run's robot front, rear"
    bench = Trajectory(log.time, {"piston/x [m]": log["front/piston/x"]}, {"kind": "bench"})
    assert "it is of a rig (bench)" in strangers(run, [bench])[0].why


def test_the_page_says_it_and_what_to_type(jump: Path, another: Path) -> None:
    log = jump / "logs" / "log-1.csv"
    words = ["review", str(log), "--run", str(another), "--out", str(another / "page.html")]
    done = CliRunner().invoke(app, [*words, "--json"])
    assert done.exit_code == 0, done.stderr
    said = json.loads(done.stdout)
    assert said["verdict"] == "fair" and said["doubt"].startswith("log-1 does not belong to ")
    assert said["command"] == f"kemba-opt review {log} --run RUN"
    page = (another / "page.html").read_text(encoding="utf-8")
    assert '<p class="doubt"><b>But:</b> log-1 does not belong to ' in page
