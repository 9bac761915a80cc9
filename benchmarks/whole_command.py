"""Where the seconds of `kemba-opt solve` go, from the start of the process to its end.

Usage: python benchmarks/whole_command.py [--repeat N] [TASK ...]

Each command runs in a process of its own. CPU seconds and wall seconds are printed for each stage.
CPU seconds count this process and those that it starts; they depend little on what else the
machine does.
"""

import argparse
import contextlib
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

TASKS = ("jump.yaml", "jump_forward.yaml")

# stage: (module, function); each stage is without those that it contains
STAGES = {
    "plan": ("kemba.ocp.finer", "searched"),
    "from an earlier plan": ("kemba.ocp.planning", "continued"),
    "refinement": ("kemba.ocp.finer", "refined"),
    "table": ("kemba.solve.trial", "retimed"),
    "replays": ("kemba.solve.trial", "judged"),
    "files": ("kemba.report.solving", "_write"),
    "figure": ("kemba.report.solving", "draw_plan"),
}


class Clock:
    """Seconds of nested stages: `own` has those of a stage without the ones inside it."""

    def __init__(self) -> None:
        self.own: dict[str, list[float]] = {}
        self.inside: list[list[float]] = [[0.0, 0.0]]

    def timed(self, name: str, function: Any) -> Any:
        """The same function with its seconds counted."""

        def run(*args: Any, **kwargs: Any) -> Any:
            self.inside.append([0.0, 0.0])
            begin = now()
            try:
                return function(*args, **kwargs)
            finally:
                took = [b - a for a, b in zip(begin, now(), strict=True)]
                within = self.inside.pop()
                so_far = self.own.get(name, [0.0, 0.0])
                self.own[name] = [s + t - w for s, t, w in zip(so_far, took, within, strict=True)]
                self.inside[-1] = [a + b for a, b in zip(self.inside[-1], took, strict=True)]

        return run


def now() -> list[float]:
    """CPU and wall seconds."""
    return [time.process_time(), time.perf_counter()]


def staged(arguments: list[str]) -> None:
    """Run the command in this process with its stages timed; print them as JSON."""
    import importlib
    import resource

    begin = time.perf_counter()
    from kemba_cli.main import app

    clock = Clock()
    for name, (module, function) in STAGES.items():
        with contextlib.suppress(ModuleNotFoundError, AttributeError):  # an older kemba
            found = importlib.import_module(module)
            setattr(found, function, clock.timed(name, getattr(found, function)))
    with contextlib.suppress(SystemExit):
        app(arguments, standalone_mode=False)
    stages = dict(clock.own)
    total = [time.process_time(), time.perf_counter() - begin]
    counted = [sum(stage[i] for stage in stages.values()) for i in (0, 1)]
    stages["start, imports, rest"] = [t - c for t, c in zip(total, counted, strict=True)]
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    stages["figure's process"] = [children.ru_utime + children.ru_stime, 0.0]
    print("\n" + json.dumps(stages))


def measured(task: str) -> dict[str, list[float]]:
    """The stages of one command in a process of its own, and the whole process."""
    with tempfile.TemporaryDirectory() as folder:
        arguments = ["solve", task, "--out", str(Path(folder) / "run"), "-q", "--no-memory"]
        begin = time.perf_counter()
        command = [sys.executable, __file__, "--staged", *arguments]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        wall = time.perf_counter() - begin
    stages: dict[str, list[float]] = json.loads(done.stdout.splitlines()[-1])
    cpu = sum(stage[0] for stage in stages.values())
    return {**stages, "whole command": [cpu, wall]}


def main() -> None:
    """Print the table."""
    if sys.argv[1:2] == ["--staged"]:
        staged(sys.argv[2:])
        return
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tasks", nargs="*", default=TASKS)
    parser.add_argument("--repeat", type=int, default=1, help="times; the least is printed")
    asked = parser.parse_args()
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores,", end=" ")
    print(f"load {os.getloadavg()[0]:.1f}, Python {platform.python_version()}")
    for task in asked.tasks:
        runs = [measured(task) for _ in range(asked.repeat)]
        print(f"\n| {task} | CPU s | wall s |\n|---|---|---|")
        for name in runs[0]:
            cpu, wall = (min(run[name][i] for run in runs) for i in (0, 1))
            print(f"| {name} | {cpu:.2f} | {wall:.2f} |")


if __name__ == "__main__":
    main()
