# ruff: noqa: E402  (the twin is found first)
"""Blind test of `discover` on robot logs made by the independent twin in tests/twin.

    python benchmarks/blind/robot.py --cases 150 --nulls 60 --out robot.jsonl

Every effect of the catalogue, every sensor fault, pairs, and effects outside the catalogue; sizes,
noise, jitter of the nominal figures, coloured disturbances and seeds drawn. Finished cases are
kept in the file, so an interrupted study goes on where it stopped.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]

import numpy as np
from twin.cases import robot_case
from twin.catalogue import CATALOGUE
from twin.measure import Sensors, fault_channels

from blind import baselines, report
from kemba.identify.checks import check_logs
from kemba.identify.discover import discover
from kemba.identify.logs import read_logs
from kemba.identify.robot import robot_problem
from kemba.model.spec import load_model

EFFECTS = [name for name, entry in CATALOGUE.items() if entry.known]
UNKNOWN = [name for name, entry in CATALOGUE.items() if not entry.known]
# where along the rail the robot stands shows in nothing else: that bias has no consequence
SENSORS = [
    f"{kind}:{channel}"
    for kind in ("sensor_bias", "sensor_scale", "sensor_delay")
    for channel in fault_channels("robot")
    if (kind, channel) != ("sensor_bias", "body/x")
]
PAIRS = [
    ("seal_friction", "valve_delay"),
    ("supply_droop", "hip_friction"),
    ("boom_force", "piston_damping"),
    ("motor_lag", "gas_spring"),
]


def cases(count: int, nulls: int) -> Iterator[dict[str, Any]]:
    """Settings of `count` cases with something hidden, then of `nulls` without."""
    rng = np.random.default_rng(21)
    kinds: list[Any] = [*EFFECTS * 4, *SENSORS, *UNKNOWN * 2, *(list(p) for p in PAIRS)]
    order = [kinds[i] for i in rng.permutation(len(kinds))]
    for number in range(count):
        yield _setting(order[number % len(order)], number, rng)
    for number in range(nulls):
        yield _setting(None, 10_000 + number, rng)


def _setting(effect: Any, seed: int, rng: np.random.Generator) -> dict[str, Any]:
    return {
        "effect": effect,
        "seed": seed,
        "size": float(rng.choice([0.7, 1.0, 1.5])),
        "noise": float(rng.choice([0.5, 1.0, 2.0])),
        "figures_off": float(rng.choice([0.01, 0.02, 0.03])),
        "floor": float(rng.choice([0.0, 0.03])),
        "runs": int(rng.choice([3, 4, 5])),
    }


def run(setting: dict[str, Any], time_limit: float) -> dict[str, Any]:
    """One case: logs made, answered, and compared with the truth."""
    options = {k: v for k, v in setting.items() if k not in ("effect", "noise")}
    sensors = Sensors(noise=setting["noise"])
    with tempfile.TemporaryDirectory() as folder:
        paths, truth = robot_case(Path(folder), setting["effect"], sensors=sensors, **options)
        logs = read_logs(paths)
        check_logs(logs)
    started = time.monotonic()
    problem = robot_problem(logs, load_model())
    answer = discover(problem, time_limit=time_limit).answer.json()
    seconds = time.monotonic() - started
    record = {"case": setting, "truth": truth["effects"], "answer": answer, "seconds": seconds}
    return {**record, "baselines": baselines.all_of(problem)}


def main() -> None:
    """Run what is not yet in the file, then print the report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=150)
    parser.add_argument("--nulls", type=int, default=60)
    parser.add_argument("--out", type=Path, default=Path("robot.jsonl"))
    parser.add_argument("--share", default="0/1", help="i/n: every n-th case only")
    parser.add_argument("--time-limit", type=float, default=600.0, help="seconds per case")
    parser.add_argument("--write", action="store_true", help="put the report into the docs")
    options = parser.parse_args()
    done = {json.dumps(r["case"], sort_keys=True) for r in report.read(options.out)}
    part, parts = (int(p) for p in options.share.split("/"))
    for number, setting in enumerate(cases(options.cases, options.nulls)):
        if number % parts == part and json.dumps(setting, sort_keys=True) not in done:
            record = run(setting, options.time_limit)
            report.append(options.out, record)
            print(report.line(record), flush=True)
    text = report.table(report.read(options.out))
    print(text)
    if options.write:
        report.write(ROOT / "docs" / "discovery.md", "robot", text)


if __name__ == "__main__":
    main()
