"""Runs of `kemba-opt solve`, each made once a session and read back from its files."""

import atexit
import shutil
import tempfile
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

from typer.testing import CliRunner

from kemba.config import load_yaml
from kemba.model import Model
from kemba.ocp import Task, load_task, task_model
from kemba.ocp.certificate.certify import Certificate, certify
from kemba.ocp.task.resolve import resolve
from kemba.runs import Run, load_run
from kemba.trajectory import Trajectory
from kemba_cli.main import app

QUICK = ("jump", "max_jump")
SHIPPED = (*QUICK, "drop", "hop", "jump_forward", "stand")


@dataclass(frozen=True)
class Solved:
    """A finished run: how the verb ended, and what lies in its folder."""

    exit_code: int
    run: Run

    @cached_property
    def task(self) -> Task:
        return load_task(self.run.task)[0]

    @cached_property
    def model(self) -> Model:
        return task_model(self.task)

    @property
    def plan(self) -> Trajectory:
        return self.run.trajectory

    @cached_property
    def measured(self) -> Certificate:
        """The certificate measured anew from the trajectory on disk."""
        requirements = resolve(self.task, self.model, load_yaml(self.run.task))
        return certify(self.model, self.task, requirements, self.plan)


@lru_cache(maxsize=16)
def solved(name: str, *options: str, nodes: int = 40) -> Solved:
    """A shipped task solved through the command line, on a coarse grid."""
    made = Path(tempfile.mkdtemp(prefix=f"kemba-test-{name}-"))
    atexit.register(shutil.rmtree, made, ignore_errors=True)
    folder = made / "run"
    words = ["solve", f"{name}.yaml", "--set", f"nodes={nodes}", "--no-figure", "-q"]
    words += ["--no-replay", "--set", "refine=none"]  # what implicit Euler itself gives
    for option in options:
        words += ["--set", option]
    done = CliRunner().invoke(app, [*words, "--out", str(folder)])
    assert done.exit_code in (0, 1), done.output
    return Solved(done.exit_code, load_run(folder))
