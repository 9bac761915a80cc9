"""docs/extending.md: its differences apply, and what they add works."""

import shutil
import subprocess
import sys
from pathlib import Path

from test_docs_effects import blocks

ROOT = Path(__file__).parent.parent

TRIAL = """
import numpy as np
from kemba.ocp.planning import program_size
from kemba.ocp.reading import load_task
from kemba.scene import scene_in

scene = scene_in({"terrain": [{"from": "0.5 m", "waves": "2 cm", "length": "0.3 m"}]})
assert scene_in(scene.dump()) == scene
print(np.round(scene.ground.height(np.array([0.4, 0.65, 0.8])), 12).tolist())
task, document = load_task("pronk.yaml")
print(sorted(task.cost), program_size(task, document)["variables"] > 1000)
"""


def test_a_cost_a_kind_of_ground_and_a_motion_are_one_file_each(tmp_path: Path) -> None:
    changes = blocks("extending.md", "diff")
    assert len(changes) == 3
    for folder in ("kemba", "configs"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=lambda _, names: {"__pycache__"})
    shutil.copy(ROOT / "pyproject.toml", tmp_path)  # a checkout has its own configs
    for change in changes:
        subprocess.run(["git", "apply", "-"], input=change, text=True, check=True, cwd=tmp_path)
    done = subprocess.run(
        [sys.executable, "-c", TRIAL], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert done.stdout.splitlines() == [
        "[0.0, 0.02, 0.0]",
        "['air', 'torque_squared', 'uneven'] True",
    ], done.stderr
