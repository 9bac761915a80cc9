# ruff: noqa: E402  (the twin is found first)
"""Blind test of `discover` on bench logs made by the independent twin in tests/twin.

    python benchmarks/blind/bench.py --cases 150 --nulls 60 --out bench.jsonl

Every effect of the catalogue that a rig can show, every sensor fault, pairs, and effects outside
the catalogue; sizes, noise, jitter of the nominal figures, coloured disturbances and seeds drawn.
Finished cases are kept in the file, so an interrupted study goes on where it stopped.
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
from twin.cases import bench_case
from twin.catalogue import CATALOGUE
from twin.measure import Sensors

from blind import baselines, report
from kemba.identify.answer import Answer
from kemba.identify.bench import bench_problem
from kemba.identify.checks import BadData, check_logs
from kemba.identify.discover import discover
from kemba.identify.logs import read_logs
from kemba.model.spec import load_model

EFFECTS = [name for name, entry in CATALOGUE.items() if entry.bench and entry.known]
UNKNOWN = [name for name, entry in CATALOGUE.items() if entry.bench and not entry.known]
SENSORS = [
    f"{kind}:{channel}"
    for kind in ("sensor_bias", "sensor_scale", "sensor_delay")
    for channel in ("piston/F", "piston/x")
]
PAIRS = [
    ("seal_friction", "valve_delay"),
    ("supply_droop", "piston_damping"),
    ("gas_spring", "hose_lag"),
    ("end_cushion", "supply_scale"),
]


def cases(count: int, nulls: int) -> Iterator[dict[str, Any]]:
    """Settings of `count` cases with something hidden, then of `nulls` without."""
    rng = np.random.default_rng(20)
    kinds: list[Any] = [*EFFECTS * 5, *SENSORS * 2, *UNKNOWN * 3, *(list(p) for p in PAIRS)]
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
        "duration": 4.0,
    }


def run(setting: dict[str, Any]) -> dict[str, Any]:
    """One case: logs made, answered, and compared with the truth."""
    options = {k: v for k, v in setting.items() if k not in ("effect", "noise")}
    sensors = Sensors(noise=setting["noise"])
    with tempfile.TemporaryDirectory() as folder:
        paths, truth = bench_case(Path(folder), setting["effect"], sensors=sensors, **options)
        logs = read_logs(paths)
    started = time.monotonic()
    record: dict[str, Any] = {"case": setting, "truth": truth["effects"]}
    try:
        check_logs(logs)
        problem = bench_problem(logs, load_model(rig=True))
        problem.plausible()
        answer = discover(problem).answer
    except BadData as error:
        answer = Answer("bad-data", sentence=str(error))
        problem = None
    seconds = time.monotonic() - started
    simple = baselines.all_of(problem) if problem else dict.fromkeys(baselines.NAMES)
    return {**record, "answer": answer.json(), "seconds": seconds, "baselines": simple}


def main() -> None:
    """Run what is not yet in the file, then print the report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=150)
    parser.add_argument("--nulls", type=int, default=60)
    parser.add_argument("--out", type=Path, default=Path("bench.jsonl"))
    parser.add_argument("--share", default="0/1", help="i/n: every n-th case only")
    parser.add_argument("--write", action="store_true", help="put the report into the docs")
    options = parser.parse_args()
    done = {json.dumps(r["case"], sort_keys=True) for r in report.read(options.out)}
    part, parts = (int(p) for p in options.share.split("/"))
    settings = list(cases(options.cases, options.nulls))
    for number in np.random.default_rng(0).permutation(len(settings)):
        setting = settings[number]
        if number % parts == part and json.dumps(setting, sort_keys=True) not in done:
            record = run(setting)
            report.append(options.out, record)
            print(report.line(record), flush=True)
    text = report.table(report.read(options.out))
    print(text)
    if options.write:
        report.write(ROOT / "docs" / "discovery.md", "bench", text)


if __name__ == "__main__":
    main()
