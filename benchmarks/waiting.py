# ruff: noqa: E402  (the twin is found first)
"""How long `compare` and `discover` take on five logs of one second, as a user waits for them.

    python benchmarks/waiting.py --write
    python benchmarks/waiting.py --beside OTHER/bin/kemba-opt --times 1 --write

Logs of the second twin (tests/mujoco_twin), cut after 1 s: one hidden effect each, then five at
once. Every command is a process of its own, figures included; on a machine with nothing else to do.
Each case is asked three times: the median is told, in brackets the least and the greatest time.
`--beside`: CPU seconds of `discover` beside those of another build on the same logs, one after the
other, and which share of them is taken.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # where pip installs, the bytecode is kept
ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]

from block import printed, put_block
from mujoco_twin.cases import robot_case

from kemba.sweep import machine

SINGLE = ("seal_friction", "payload", "boom_force", "valve_delay", "hip_friction", "cross_leak")
SEVERAL = (
    ("supply_droop", "seal_friction", "boom_friction", "motor_lag", "com_offset"),
    ("cross_leak", "hip_friction", "boom_force", "valve_delay", "payload"),
    ("geometry:tibia/length", "piston_damping", "hip_damping", "torque_scale", "boom_inertia"),
)
SEED = 8100
SECONDS = 1.0  # of each log
PAGE = ROOT / "benchmarks" / "pages" / "benchmarks.md"
BEGIN, END = "<!-- waiting: written by benchmarks/waiting.py -->", "<!-- end of waiting -->"
BESIDE = ("<!-- beside: written by benchmarks/waiting.py --beside -->", "<!-- end of beside -->")
OWN = Path(sys.executable).with_name("kemba-opt")


def logs(effects: Sequence[str], seed: int, folder: Path) -> list[Path]:
    """Five logs of a machine with these effects, of one second each."""
    paths, _ = robot_case(folder, effects, seed=seed, runs=5)
    for path in paths:
        head, *rows = path.read_text(encoding="utf-8").splitlines()
        begin = float(rows[0].split(",")[0])
        kept = [row for row in rows if float(row.split(",")[0]) - begin <= SECONDS]
        path.write_text("\n".join([head, *kept]) + "\n", encoding="utf-8")
    return paths


def waited(
    verb: str, paths: Sequence[Path], *options: str, program: Path = OWN
) -> tuple[float, float, dict[str, Any]]:
    """Seconds of wall and of CPU that a command takes, and its answer."""
    command = [str(program), verb, *map(str, paths), "--json", "-q", *options]
    begun, cpu = time.perf_counter(), _children()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return time.perf_counter() - begun, _children() - cpu, json.loads(done.stdout)


def _children() -> float:
    """CPU seconds of all processes that were waited for."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def asked(effects: Sequence[str], seed: int) -> tuple[float, float, str]:
    """Seconds of `compare` and of `discover` on new logs, and what the answer says."""
    with tempfile.TemporaryDirectory() as name:
        paths = logs(effects, seed, Path(name))
        compared, _, _ = waited("compare", paths)
        found, _, answer = waited("discover", paths, "--out", str(Path(name) / "answer"))
    says = f"{answer['verdict']}: {', '.join(answer['added']) or 'no effect'}"
    print(f"{', '.join(effects)}: {compared:.1f} s, {found:.1f} s, {says}", flush=True)
    return compared, found, says


def beside(other: Path, cases: int | None, times: int) -> Iterator[str]:
    """Lines of the table of CPU seconds beside another build's program."""
    chosen = [*((name,) for name in SINGLE), *SEVERAL][:cases]
    yield "| hidden | discover, CPU s | the other build | share | it says |"
    yield "|---|---:|---:|---:|---|"
    shares = []
    for i, effects in enumerate(chosen):
        taken: dict[Path, list[float]] = {OWN: [], other: []}
        says = []
        with tempfile.TemporaryDirectory() as name:
            paths = logs(effects, SEED + i, Path(name))
            for number in range(times):
                for program in taken:
                    out = str(Path(name) / f"{number}-{program.parents[1].name}")
                    _, cpu, answer = waited("discover", paths, "--out", out, program=program)
                    taken[program].append(cpu)
                    if program is OWN:
                        says.append(", ".join(answer["added"]) or answer["verdict"])
        own, old = (median(seconds) for seconds in taken.values())
        shares.append(own / old)
        told = " / ".join(dict.fromkeys(says))
        yield f"| {', '.join(effects)} | {own:.1f} | {old:.1f} | {own / old:.2f} | {told} |"
    yield f"| median | | | {median(shares):.2f} | |"


def table(cases: int | None, times: int) -> Iterator[str]:
    """Lines of the table, of so many cases (None: all), each asked so many times.

    All cases come before the next time, as a shared machine is slow for minutes.
    """
    chosen = [*((name,) for name in SINGLE), *SEVERAL][:cases]
    rounds = [[asked(c, SEED + i) for i, c in enumerate(chosen)] for _ in range(times)]
    yield "| hidden | compare [s] | discover [s] | it says |"
    yield "|---|---:|---:|---|"
    for effects, answers in zip(chosen, zip(*rounds, strict=True), strict=True):
        compared, found, says = zip(*answers, strict=True)
        cells = (
            ", ".join(effects),
            spread(compared),
            spread(found),
            " / ".join(dict.fromkeys(says)),
        )
        yield f"| {' | '.join(cells)} |"


def spread(seconds: Sequence[float]) -> str:
    """The median, and in brackets the least and the greatest."""
    return f"{median(seconds):.1f} ({min(seconds):.1f} to {max(seconds):.1f})"


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="put the table into the docs")
    parser.add_argument("--cases", type=int, help="so many of the beginning only")
    parser.add_argument("--times", type=int, default=3, help="how often each case is asked (3)")
    parser.add_argument("--beside", type=Path, help="kemba-opt of another build")
    options = parser.parse_args()
    if options.beside:
        lines = printed(beside(options.beside, options.cases, options.times))
        if options.write:
            put_block(PAGE, *BESIDE, [*lines, "", f"Asked {options.times} times, on {machine()}."])
        return
    lines = printed(table(options.cases, options.times))
    if options.write:
        how = f"Asked {options.times} times each: median, in brackets the range, on {machine()}."
        put_block(PAGE, BEGIN, END, [*lines, "", how])


if __name__ == "__main__":
    main()
