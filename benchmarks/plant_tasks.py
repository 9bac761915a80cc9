"""How the shipped tasks' plans come true: replay on the same model, execution on the full plant.

    python benchmarks/plant_tasks.py [--save docs/plant.md] [TASK ...]

Prints a table, one line per task; `--save` puts it between the marks in the page. Each case is
`kemba-opt solve TASK` as anyone runs it.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from block import put_block

from kemba.sweep.farm import machine

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
    columns = "apex | touchdown | end"
    yield f"| task | replay: {columns} | table: {columns} | plant: {columns} | landing | exit |"
    yield "|---|---|---|---|---|---|---|---|---|---|---|---|"
    for task in tasks:
        answer = solve(task)
        executed = [answer[key] for key in ("replay", "table_replay", "plant_replay")]
        if None in executed:
            yield f"| `{task}` | {answer['sentence']} {'| ' * 10}| {answer['exit']} |"
            continue
        errors = " | ".join(map(_errors, executed))
        landing = "good" if executed[-1]["landed"] else executed[-1]["fault"]
        yield f"| `{task}` | {errors} | {landing} | {answer['exit']} |"
    yield ""
    yield f"Errors are executed minus planned. Machine: {machine()}."


def _errors(facts: dict[str, Any]) -> str:
    late = facts["touchdown_error_s"]
    touchdown = "-" if late is None else f"{1e3 * late:+.2f} ms"
    apex, end = (f"{1e3 * facts[key]:+.2f} mm" for key in ("apex_error_m", "final_error_m"))
    return f"{apex} | {touchdown} | {end}"


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
        put_block(asked.save, *MARKS, lines)


if __name__ == "__main__":
    main()
