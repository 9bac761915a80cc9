"""The figure is the same whoever draws it, and a process that dies is replaced."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from kemba.errors import KembaError
from kemba.report.solving import FIGURE, Beside, Here, drawer
from kemba.trajectory import Trajectory


@pytest.fixture
def plan(tmp_path: Path) -> Trajectory:
    (tmp_path / "task.yaml").write_text("model: planning\n", encoding="utf-8")
    time = np.linspace(0.0, 0.5, 20)
    columns = {"body/z [m]": 0.2 + time - time**2, "front/piston/x [m]": 0.01 + 0.02 * time}
    return Trajectory(time, columns, {"kind": "plan"})


def test_the_second_process_draws_the_same(plan: Trajectory, tmp_path: Path) -> None:
    other = tmp_path / "other"
    other.mkdir()
    (other / "task.yaml").write_text("model: planning\n", encoding="utf-8")
    beside, here = Beside(), Here()
    beside.begin(plan, other)
    here.begin(plan, tmp_path)
    here.finish()
    beside.finish()
    beside.close()
    assert (other / FIGURE).read_bytes() == (tmp_path / FIGURE).read_bytes()


def test_a_dead_process_is_replaced_and_errors_are_told(plan: Trajectory, tmp_path: Path) -> None:
    beside = Beside()
    beside.process.kill()
    beside.process.join()
    beside.begin(plan, tmp_path)
    beside.finish()
    assert (tmp_path / FIGURE).is_file()
    (tmp_path / "taken").write_text("not a folder", encoding="utf-8")
    beside.begin(plan, tmp_path / "taken")
    with pytest.raises(KembaError, match=r"cannot be written"):
        beside.finish()
    beside.close()


def test_where_matplotlib_is_loaded_this_process_draws() -> None:
    import matplotlib  # noqa: F401

    with drawer(True) as drawing:
        assert type(drawing) is Here


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
