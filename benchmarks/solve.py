"""Time the shipped tasks: program sizes, build and solve times, iterations, all from a cold start.

    python benchmarks/solve.py --repeats 5 --save benchmarks/pages/benchmarks.md

Every case is a fresh process of `kemba-opt solve`, one after the other; the cases take turns, so
that a slow minute of the machine meets all of them. Prints a table in Markdown; `--save` replaces
the figures of a page. Run it on a quiet machine. Tasks may be followed by overrides:
`jump.yaml,nodes=200`.
"""

import argparse
import json
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from datetime import date
from pathlib import Path
from typing import Any

from kemba.runs import versions

TASKS = ("jump", "max_jump", "hop", "jump_forward", "stand", "drop")
HEAD = "| task | status | variables | rows | iterations | build s | solve s | CPU s | process s |"
MARK = "<!-- figures: written by benchmarks/solve.py, do not edit below -->"
VERB = "from kemba_cli.main import main; main()"


def measure(case: str) -> dict[str, Any]:
    """The answer of one cold solve, with the whole process's time added."""
    task, *overrides = case.split(",")
    options = [word for override in overrides for word in ("--set", override)]
    with tempfile.TemporaryDirectory() as folder:
        words = ["solve", f"{task.removesuffix('.yaml')}.yaml", *options, "--out", f"{folder}/run"]
        command = [sys.executable, "-c", VERB, *words, "--no-figure", "--json"]
        started = time.perf_counter()
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        seconds = time.perf_counter() - started
    if not done.stdout:
        raise SystemExit(f"{case}: {done.stderr}")
    return {**json.loads(done.stdout), "process_s": seconds}


def row(case: str, answers: list[dict[str, Any]]) -> str:
    """One line of the table: medians, and the range of the solve times."""

    def median(key: str, form: str = ".2f") -> str:
        return f"{statistics.median(a[key] for a in answers):{form}}"

    times = [a["solve_s"] for a in answers]
    spread = f" ({min(times):.2f} to {max(times):.2f})" if len(times) > 1 else ""
    status = ", ".join(sorted({a["status"] for a in answers}))
    cells = (
        case.replace(",", ", "),
        status,
        *(median(key, ".0f") for key in ("variables", "constraints", "iterations")),
        median("build_s"),
        median("solve_s") + spread,
        median("solve_cpu_s"),
        median("process_s"),
    )
    return f"| {' | '.join(cells)} |"


def machine() -> str:
    """Where and with what the figures were made."""
    processor = platform.processor() or platform.machine()
    known = Path("/proc/cpuinfo")
    if known.is_file():
        lines = [line for line in known.read_text().splitlines() if line.startswith("model name")]
        processor = f"{len(lines)} x {lines[0].partition(':')[2].strip()}" if lines else processor
    libraries = ", ".join(f"{name} {version}" for name, version in versions().items())
    return f"{date.today()}, {processor}, {platform.system()}; {libraries}."


def main() -> None:
    """Run every case `--repeats` times and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("cases", nargs="*", default=TASKS, help="tasks, all the shipped ones")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--save", type=Path, help="page whose figures are replaced")
    options = parser.parse_args()
    answers: dict[str, list[dict[str, Any]]] = {case: [] for case in options.cases}
    for turn in range(options.repeats):
        for case, found in answers.items():
            found.append(measure(case))
            last = found[-1]
            told = f"{turn + 1}/{options.repeats} {case}: {last['status']}, {last['solve_s']:.2f} s"
            print(told, file=sys.stderr)
    rule = "|---|---|" + "---:|" * (HEAD.count("|") - 3)
    note = f"Medians of {options.repeats} cold runs; in brackets the range. {machine()}"
    table = "\n".join([HEAD, rule, *(row(case, found) for case, found in answers.items())])
    print(f"{note}\n\n{table}")
    if options.save is not None:
        above = options.save.read_text(encoding="utf-8").partition(MARK)[0].rstrip()
        options.save.write_text(f"{above}\n\n{MARK}\n\n{note}\n\n{table}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
