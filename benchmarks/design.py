# ruff: noqa: E402  (the twin is found first)
"""How well designed tests of a rig separate rivals, done on the independent twin in tests/twin.

    python benchmarks/design.py --out design.jsonl --write

Each case: a machine of the twin with one hidden effect does one fill and one stroke. The effect and
its rival are fitted to that log, as an answer would have them. `experiment` designs the next test,
the twin does it, and the evidence between both is measured. Finished cases are kept in the file.
"""

import argparse
import math
import os
import sys
import tempfile
import time
from pathlib import Path
from typing import Any
from unittest.mock import patch

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]

from blind import report
from rehearsal import FIRST, Machine, fitted, measured_evidence, problem_of

from kemba.identify.design.rig import design_rig_test
from kemba.identify.design.separation import DesignSearchSettings, ExperimentSettings, JudgedTest
from kemba.model.spec import load_model
from kemba.scenarios.share import wilson

DOCS = ROOT / "docs" / "experiment.md"
PAIRS = (  # what is there, and what it is taken for
    ("seal_friction", "piston_damping"),
    ("cross_leak", "supply_droop"),
    ("valve_delay", "sensor_delay:piston/F"),
    ("supply_scale", "sensor_scale:piston/F"),
    ("hose_lag", "rise_time_scale"),
    ("pressure_friction", "seal_friction"),
    ("gas_spring", "end_cushion"),
    ("both_mode_loss", "supply_droop"),
    ("quadratic_damping", "piston_damping"),
    ("stribeck_friction", "seal_friction"),
)
SEED = 9000
HALF = 0.501  # half, up to rows
LONGEST = 5.0  # s; standard tests with longer logs are judged by what is expected of them only


def run(truth: str, other: str, seed: int) -> dict[str, Any]:
    """One case: a first log, a designed test, and what it tells."""
    model, machine = load_model("planning", rig=True), Machine(truth, seed)
    stroke, started = model.mechanism.stroke, time.process_time()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        first = problem_of(machine.done(FIRST, stroke, folder), model)
        rivals = fitted(first, (truth, other))
        before = measured_evidence(first, rivals, truth, other)
        with patch.object(DesignSearchSettings, "budget", math.inf):
            design = design_rig_test(model, rivals)
        seconds = time.process_time() - started
        assert design is not None

        def told(judged: JudgedTest) -> float | None:
            if judged.log_s > LONGEST:
                return None
            logs = machine.done(judged.test, stroke, folder)
            return measured_evidence(problem_of(logs, model), rivals, truth, other)

        sides = {
            side: {
                "rig": judged.test.name,
                "log_s": judged.log_s,
                "expected": judged.least,
                "measured": told(judged),
            }
            for side, judged in (("standard", design.standard), ("designed", design.designed))
        }
    case = {"truth": truth, "rival": other, "seed": seed}
    return {"case": case, "before": before, "seconds": seconds, "tried": design.tried, **sides}


def table(records: list[dict[str, Any]]) -> str:
    """The page's table and its summary."""
    clear = ExperimentSettings.clear
    rows = [
        "| hidden | rival | first log | best standard test | log | expected | measured "
        "| designed: log | expected | measured |",
        "|---|---|---:|---|---:|---:|---:|---:|---:|---:|",
    ]
    for r in records:
        s, d = r["standard"], r["designed"]
        cells = (r["case"]["truth"], r["case"]["rival"], _n(r["before"]), s["rig"],
                 f"{s['log_s']:.1f} s", _n(s["expected"]), _n(s["measured"]),
                 f"{d['log_s']:.2f} s", _n(d["expected"]), _n(d["measured"]))  # fmt: skip
        rows.append("| " + " | ".join(cells) + " |")
    count = len(records)
    hits = sum(r["designed"]["measured"] >= clear and _share(r) <= HALF for r in records)
    faster = sum(_pace(r["designed"]) > _pace(r["standard"]) for r in records)
    low, high = wilson(hits, count)
    seconds = sorted(r["seconds"] for r in records)[count // 2]
    return (
        "\n".join(rows) + f"\n\n{count} of {2 * len(PAIRS)} cases have run. Evidence in nats. "
        f"In {hits} of {count} cases the designed test gave at least "
        f"{clear:g} nats for the effect that is there, in at most half the log time of the best "
        f"standard test (95 % interval {100 * low:.0f} to {100 * high:.0f} %). More evidence per "
        f"second of log than the best standard test was expected in {faster} of {count}. One "
        f"design took {seconds:.0f} s of processor time (median)."
    )


def _share(record: dict[str, Any]) -> float:
    """Log time of the designed test as a share of that of the best standard test."""
    return float(record["designed"]["log_s"] / record["standard"]["log_s"])


def _pace(side: dict[str, Any]) -> float:
    return float(side["expected"] / side["log_s"])


def _n(nats: float | None) -> str:
    return "not done" if nats is None else f"{nats:.1f}" if abs(nats) < 100 else f"{nats:.0f}"


def main() -> None:
    """Run what the file lacks, then print or write the page's table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("design.jsonl"))
    parser.add_argument("--cases", type=int, default=2 * len(PAIRS), help="so many only")
    parser.add_argument("--write", action="store_true", help="put the table into the docs")
    parser.add_argument("--part", default="1/1", help="i/n: every n-th case, from the i-th on")
    parser.add_argument("--report", action="store_true", help="run nothing, only report the file")
    options = parser.parse_args()
    part, parts = (int(p) for p in options.part.split("/"))
    done = [r["case"] for r in report.read(options.out)]
    cases = [*PAIRS, *((b, a) for a, b in PAIRS)][: 0 if options.report else options.cases]
    for number, (truth, other) in list(enumerate(cases))[part - 1 :: parts]:
        if {"truth": truth, "rival": other, "seed": SEED + number} not in done:
            record = run(truth, other, SEED + number)
            report.append(options.out, record)
            print(record, flush=True)
    found = table(report.read(options.out))
    print(found)
    if options.write:
        report.write(DOCS, "design", found)


if __name__ == "__main__":
    main()
