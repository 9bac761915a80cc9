"""How the shipped tasks' plans come true: replay on the same model, execution on the full plant.

    python benchmarks/plant_tasks.py [--save docs/plant.md] [TASK ...]

Prints a table, one line per task; `--save` puts it between the marks in the page. Each case is
`kemba-opt solve TASK` as anyone runs it.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from kemba.files import atomic_text
from kemba.sweep.machine import machine

TASKS = ("jump", "hop", "max_jump", "drop", "stand", "jump_forward")
MARKS = ("<!-- executions: written by benchmarks/plant_tasks.py -->", "<!-- end of executions -->")
SOLVE = "from kemba_cli.main import main; main()"


def solve(task: str) -> dict[str, Any]:
    """The certificate of a shipped task, and the exit code."""
    with tempfile.TemporaryDirectory() as folder:
        out = str(Path(folder) / "run")
        words = ["solve", f"{task}.yaml", "--out", out, "--no-figure", "--json"]
        done = subprocess.run(
            [sys.executable, "-c", SOLVE, *words], capture_output=True, text=True, check=False
        )
    return {**json.loads(done.stdout), "exit": done.returncode}


def table(tasks: list[str]) -> Iterator[str]:
    yield "| task | replay: apex | touchdown | end | plant: apex | touchdown | landing | exit |"
    yield "|---|---|---|---|---|---|---|---|"
    for task in tasks:
        answer = solve(task)
        own, plant = answer["replay"], answer["plant_replay"]
        if own is None or plant is None:
            yield f"| `{task}` | {answer['sentence']} | | | | | | {answer['exit']} |"
            continue
        landing = "good" if plant["landed"] else plant["fault"]
        yield (
            f"| `{task}` | {_mm(own['apex_error_m'])} | {_ms(own['touchdown_error_s'])} "
            f"| {_mm(own['final_error_m'])} | {_mm(plant['apex_error_m'], 0)} "
            f"| {_ms(plant['touchdown_error_s'], 0)} | {landing} | {answer['exit']} |"
        )
    yield ""
    yield f"Errors are executed minus planned. Machine: {machine()}."


def _mm(value: float, digits: int = 2) -> str:
    return f"{1e3 * value:+.{digits}f} mm"


def _ms(value: float | None, digits: int = 2) -> str:
    return "-" if value is None else f"{1e3 * value:+.{digits}f} ms"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tasks", nargs="*", default=list(TASKS))
    parser.add_argument("--save", type=Path)
    asked = parser.parse_args()
    lines = []
    for line in table(asked.tasks):
        print(line, flush=True)
        lines.append(line)
    if asked.save:
        text = asked.save.read_text(encoding="utf-8")
        block = "\n".join([MARKS[0], "", *lines, "", MARKS[1]])
        pattern = f"{re.escape(MARKS[0])}.*{re.escape(MARKS[1])}"
        with atomic_text(asked.save) as stream:
            stream.write(re.sub(pattern, lambda _: block, text, flags=re.DOTALL))


if __name__ == "__main__":
    main()
