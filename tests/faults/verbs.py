"""Long-running verbs as small commands, what each must leave behind, and how it goes on."""

import atexit
import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from fuzz.logs import cells, text
from fuzz.sound import bench
from plain_task import plain_task

from kemba.config import load_yaml
from kemba.errors import KembaError
from kemba.trajectory import Trajectory

# what differs between two runs of one command: times
VARIES = {"started", "finished", "command", "runtime_s", "build_s"}
VARIES |= {"solve_s", "solve_cpu_s", "wall_s", "cpu_s"}
SWEEP = """\
name: small
seed: 1
blocks:
  a: {kind: solve, task: task.yaml, replay: false, grid: {height: [0.34 m, 0.35 m]}}
"""
TASK = """\
name: quick
height: 0.35 m
nodes: 12
duration: 0.5 s
refine: none
start: {rest: true, body/x: 0 m, body/pitch: 0 deg, '*/foot/z': 0 m}
goals: {apex: {quantity: body/z, at: middle, equals: height}}
"""


@dataclass(frozen=True)
class Verb:
    """`words`: the command; `out`: its folder; `results`: files that are the same after each run;
    `begin` makes its inputs."""

    words: tuple[str, ...]
    out: str
    results: tuple[str, ...]
    begin: Callable[[Path], None]


def _task(folder: Path) -> None:
    (folder / "task.yaml").write_text(TASK, encoding="utf-8")


def _sweep(folder: Path) -> None:
    _task(folder)
    (folder / "sweep.yaml").write_text(SWEEP, encoding="utf-8")


def _log(folder: Path) -> None:
    (folder / "log.csv").write_text(text(cells(bench())), encoding="utf-8")


WEAK = "name: weak\nbase: planning\neffects:\n  - {kind: supply_scale, k: 0.9}\n"
BEFORE = (  # what is learnt from: a plan, executed on a machine whose supply is weak
    "solve task.yaml --set height=0.45m --set duration=0.7s --no-figure --out run",
    "simulate run --model weak.yaml --noise --out logs",
)


@cache
def _executed() -> Path:
    """A folder with an executed run, made once."""
    folder = Path(tempfile.mkdtemp(prefix="kemba-executed-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    plain_task(folder).rename(folder / "task.yaml")
    (folder / "weak.yaml").write_text(WEAK, encoding="utf-8")
    code = "from kemba_cli.main import main; main()"
    for words in BEFORE:
        subprocess.run([sys.executable, "-c", code, *words.split()], cwd=folder, check=True)
    return folder


def _run(folder: Path) -> None:
    shutil.copytree(_executed(), folder, dirs_exist_ok=True)


VERBS = {
    "solve": Verb(
        ("solve", "task.yaml", "--out", "out", "--no-replay", "--no-figure"),
        "out",
        ("trajectory.csv", "controller.csv", "task.yaml", "certificate.json"),
        _task,
    ),
    "simulate": Verb(
        ("simulate", "locked.yaml", "--out", "out", "--noise"), "out", ("*.csv",), lambda _: None
    ),
    "discover": Verb(
        ("discover", "log.csv", "--out", "out", "--no-figure"), "out", ("answer.json",), _log
    ),
    "sweep": Verb(
        ("sweep", "sweep.yaml", "--out", "out", "--jobs", "1"), "out", ("cases/*.json",), _sweep
    ),
    "learn": Verb(
        ("learn", "run", "--logs", "logs", "--out", "out"),
        "out",
        ("trajectory.csv", "controller*.csv", "answer/answer.json", "correction.yaml"),
        _run,
    ),
}


def contents(folder: Path, patterns: tuple[str, ...]) -> dict[str, Any]:
    """What the result files of a folder say, without what varies from run to run.

    Hidden files are no results: a write that was killed may leave one.
    """
    found: dict[str, Any] = {}
    files = [file for pattern in patterns for file in sorted(folder.glob(pattern))]
    for file in (file for file in files if not file.name.startswith(".")):
        name = str(file.relative_to(folder))
        if file.suffix == ".json":
            found[name] = _lasting(json.loads(file.read_text(encoding="utf-8")))
        else:
            found[name] = file.read_bytes()
    return found


def _lasting(data: Any) -> Any:
    if isinstance(data, dict):
        return {k: _lasting(v) for k, v in data.items() if k not in VARIES}
    return [_lasting(item) for item in data] if isinstance(data, list) else data


def half_written(folder: Path) -> list[str]:
    """Files under a final name that cannot be read to their end."""
    broken = []
    for file in (f for f in folder.rglob("*") if f.is_file() and not f.name.startswith(".")):
        try:
            if file.suffix == ".json":
                json.loads(file.read_text(encoding="utf-8"))
            elif file.suffix == ".yaml":
                load_yaml(file)
            elif file.name != "results.csv" and file.suffix == ".csv":
                Trajectory.read(file)
        except (KembaError, ValueError) as error:
            broken.append(f"{file}: {error}")
    return broken


def emptied(folder: Path) -> Path:
    """A folder without anything in it."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder
