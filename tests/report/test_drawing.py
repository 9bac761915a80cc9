"""The figure of a plan, and what is loaded only when it is drawn."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from kemba.errors import KembaError
from kemba.report.solving import FIGURE, draw_plan
from kemba.trajectory import Trajectory


@pytest.fixture
def plan(tmp_path: Path) -> Trajectory:
    (tmp_path / "task.yaml").write_text("model: planning\n", encoding="utf-8")
    time = np.linspace(0.0, 0.5, 20)
    columns = {"body/z [m]": 0.2 + time - time**2, "front/piston/x [m]": 0.01 + 0.02 * time}
    return Trajectory(time, columns, {"kind": "plan"})


def test_the_figure_of_a_plan_is_written_and_errors_are_told(
    plan: Trajectory, tmp_path: Path
) -> None:
    draw_plan(plan, tmp_path)
    assert (tmp_path / FIGURE).is_file()
    (tmp_path / "taken").write_text("not a folder", encoding="utf-8")
    with pytest.raises(KembaError, match=r"cannot be written"):
        draw_plan(plan, tmp_path / "taken")


def test_a_plan_needs_neither_matplotlib_nor_what_sweeps_need() -> None:
    """Imports cost up to half a second each."""
    code = (
        "import sys; from kemba.ocp import load_task, task_model; import kemba.report;"
        "t, d = load_task('jump.yaml'); task_model(t, document=d);"
        "heavy = {'matplotlib', 'scipy.stats', 'scipy.signal', 'dask', 'pint', 'pandas'};"
        "print(sorted(heavy & set(sys.modules)))"
    )
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=os.environ)
    assert done.stdout.strip() == "[]"
