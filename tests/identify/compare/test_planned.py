"""A comparison with the plan that was executed: a run folder, or a trajectory."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kemba.identify import workflow
from kemba.trajectory import Trajectory


@dataclass(frozen=True)
class Compared:
    plan: Any = None


@pytest.mark.parametrize("folder", [True, False])
def test_a_plan_is_a_run_or_its_trajectory(
    folder: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "trajectory.csv"
    Trajectory(np.arange(3.0), {"body/z [m]": np.array([0.3, 0.4, 0.5])}).write(file)
    monkeypatch.setattr(workflow, "read_logs", lambda *_: ["log"])
    monkeypatch.setattr(workflow, "compare_read", lambda *_: (Compared(), None))
    monkeypatch.setattr(workflow, "missed", lambda plan, logs: (plan["body/z"].tolist(), logs))
    found: Any = workflow.compare_logs(["log.csv"], run=tmp_path if folder else file)[0]
    assert found.plan == ([0.3, 0.4, 0.5], ["log"])
    assert workflow.compare_logs(["log.csv"])[0] == Compared()
