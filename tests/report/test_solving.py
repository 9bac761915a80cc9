"""`solve` as a whole: replays in the certificate, several starts, the best kept."""

from __future__ import annotations

import json
from pathlib import Path

from kemba.ocp import load_task
from kemba.report import Listener, solve_into
from kemba.runs import RunFolder

OPTIONS = ["nodes=30", "solver.time_limit=120 s"]


def test_the_certificate_tells_what_execution_gave(tmp_path: Path) -> None:
    task, document = load_task("hop.yaml", OPTIONS)
    folder = RunFolder.create(tmp_path / "run", task.name)
    answer = solve_into(folder, task, document, Listener(), figure=False)
    assert answer == json.loads((folder / "certificate.json").read_text())
    for executed in (answer["replay"], answer["plant_replay"]):
        assert abs(executed["apex_error_m"]) < 0.1
        assert isinstance(executed["landed"], bool)
    assert "replay reaches" in answer["sentence"]


def test_the_best_of_several_starts_is_kept(tmp_path: Path) -> None:
    task, document = load_task("hop.yaml", OPTIONS)
    told: list[str] = []
    folder = RunFolder.create(tmp_path / "run", task.name)
    listener = Listener(told.append)
    answer = solve_into(
        folder, task, document, listener, starts=2, jobs=2, replay=False, figure=False
    )
    tried = [line for line in told if line.startswith("start ")]
    assert answer["status"] == "solved"
    assert len(tried) == 2
    best = min(float(line.rsplit(" ", 1)[1]) for line in tried if "solved" in line)
    assert answer["cost"]["torque_squared_integral"] <= best * 1.05 + 1e-3
