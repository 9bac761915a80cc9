"""What `solve --robust 60` costs: python benchmarks/robust_cost.py [--save docs/tasks.md].

Every task is planned by the whole command, plain and then robust, each in a process of its own.
CPU seconds count the process and its children. Run it on a machine that does nothing else.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from block import put_block

from kemba.sweep import machine

HEIGHTS = (0.36, 0.4, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.82, 0.85, 0.88, 0.9)  # m
TASKS: tuple[tuple[str, ...], ...] = (
    *(("jump.yaml", f"height={height} m") for height in HEIGHTS),
    *(("jump_forward.yaml", f"distance=0.{tenths} m") for tenths in range(1, 7)),
    *((name,) for name in ("hop.yaml", "drop.yaml", "stand.yaml", "max_jump.yaml")),
)
SCENARIOS = 60
ASKED = 3.0  # times the solve time of a plain plan
MARKS = ("<!-- robust: written by benchmarks/robust_cost.py -->", "<!-- end of robust -->")


@dataclass(frozen=True)
class Command:
    """One run of the command: CPU seconds, torque cost of its plan, scenarios that succeed."""

    seconds: float
    torque: float
    landed: int | None


def run(words: Sequence[str], robust: int) -> Command:
    """Plan a task in a process of its own. Raises CalledProcessError where the plan is not good."""
    sets = [part for word in words[1:] for part in ("--set", word)]
    before = seconds()
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        call = [sys.executable, "-c", "from kemba_cli.main import main; main()"]
        call += ["solve", words[0], *sets, "-q"]
        call += ["--robust", str(robust)] if robust else []
        subprocess.run([*call, "--out", str(out)], check=True, capture_output=True)
        told = json.loads((out / "certificate.json").read_text(encoding="utf-8"))
    landed = told["robust"]["landed"] if robust else None
    return Command(seconds() - before, told["cost"]["torque_squared_integral"], landed)


def seconds() -> float:
    """CPU seconds of all processes that were started here and have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def table(rows: Sequence[tuple[str, Command, Command]]) -> Iterator[str]:
    """The lines of the page."""
    times = {name: robust.seconds / plain.seconds for name, plain, robust in rows}
    worst = max(times, key=lambda name: times[name])
    within = sum(ratio <= ASKED for ratio in times.values())
    yield (
        f"{within} of {len(rows)} tasks take at most {ASKED:g} times the CPU time of a plain plan; "
        f"the most is {times[worst]:.1f} times (`{worst}`)."
    )
    yield ""
    yield "| task | plain [CPU s] | robust [CPU s] | times | torque², times | scenarios |"
    yield "|---|---:|---:|---:|---:|---:|"
    for name, plain, robust in rows:
        yield (
            f"| {name} | {plain.seconds:.1f} | {robust.seconds:.1f} | {times[name]:.1f} "
            f"| {robust.torque / plain.torque:.2f} | {robust.landed} of {SCENARIOS} |"
        )
    yield ""
    yield f"On {machine()}."


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--save", type=Path, help="the page to write the table into")
    asked = parser.parse_args()
    rows = []
    for words in TASKS:
        name = " ".join(words).replace(".yaml", "").replace("=", " ")
        rows.append((name, run(words, 0), run(words, SCENARIOS)))
        print(*rows[-1], flush=True)
    lines = list(table(rows))
    if asked.save:
        put_block(asked.save, *MARKS, lines)
    print("\n".join(lines))


if __name__ == "__main__":
    main()
