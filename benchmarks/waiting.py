# ruff: noqa: E402  (the twin is found first)
"""How long `compare` and `discover` take on five logs of one second, as a user waits for them.

    python benchmarks/waiting.py --write

Logs of the second twin (tests/mujoco_twin), cut after 1 s: one hidden effect each, then five at
once. Every command is a process of its own, figures included; on a machine with nothing else to do.
"""

from __future__ import annotations

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
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
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
PAGE = ROOT / "docs" / "benchmarks.md"
BEGIN, END = "<!-- waiting: written by benchmarks/waiting.py -->", "<!-- end of waiting -->"


def logs(effects: Sequence[str], seed: int, folder: Path) -> list[Path]:
    """Five logs of a machine with these effects, of one second each."""
    paths, _ = robot_case(folder, effects, seed=seed, runs=5)
    for path in paths:
        head, *rows = path.read_text(encoding="utf-8").splitlines()
        begin = float(rows[0].split(",")[0])
        kept = [row for row in rows if float(row.split(",")[0]) - begin <= SECONDS]
        path.write_text("\n".join([head, *kept]) + "\n", encoding="utf-8")
    return paths


def waited(verb: str, paths: Sequence[Path], *options: str) -> tuple[float, float, dict[str, Any]]:
    """Wall and CPU seconds of a command, and its answer."""
    program = str(Path(sys.executable).with_name("kemba-opt"))
    command = [program, verb, *map(str, paths), "--json", "-q", *options]
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    wall, after = time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return wall, cpu, json.loads(done.stdout)


def rows(cases: int | None) -> Iterator[str]:
    """Lines of the table, of so many cases (None: all)."""
    yield "| hidden | compare: wall s | CPU s | discover: wall s | CPU s | it says |"
    yield "|---|---:|---:|---:|---:|---|"
    for i, effects in enumerate([*((name,) for name in SINGLE), *SEVERAL][:cases]):
        with tempfile.TemporaryDirectory() as name:
            paths = logs(effects, SEED + i, Path(name))
            compared = waited("compare", paths)
            found = waited("discover", paths, "--out", str(Path(name) / "answer"))
        answer = found[2]
        says = f"{answer['verdict']}: {', '.join(answer['found']) or 'no effect'}"
        seconds = (f"{s:.1f}" for s in (*compared[:2], *found[:2]))
        yield f"| {', '.join(effects)} | {' | '.join(seconds)} | {says} |"


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="put the table into the docs")
    parser.add_argument("--cases", type=int, help="so many of the beginning only")
    options = parser.parse_args()
    lines = printed(rows(options.cases))
    if options.write:
        put_block(PAGE, BEGIN, END, [*lines, "", f"On {machine()}."])


if __name__ == "__main__":
    main()
