"""The highest jump and the fastest bound of many starts, beside bounds from energy and torque.

    python benchmarks/many_starts.py --count 40
    python benchmarks/many_starts.py --save benchmarks/pages/plan-quality.md

Start 0 is the guess of the task, every other one has noise (as `--starts` does), two at a time.
Each is planned and refined; its executions are not part of this.
"""

import argparse
import os
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from block import Record

from kemba.model import Model, load_model
from kemba.ocp import load_task
from kemba.ocp.infeasibility.checks import air_work, inertia_and_weight
from kemba.ocp.planning import SPREAD, plan
from kemba.ocp.task.templates import longest_leg
from kemba.sweep import machine

RECORD = Path(__file__).with_name("many_starts.jsonl")
BEGIN, END = "<!-- written by benchmarks/many_starts.py -->", "<!-- end of many starts -->"
FAST = "goals.stride={quantity: body/vx, at: start, maximise: true}"
TASKS: dict[str, tuple[str, list[str], str]] = {  # file, settings, unit of what is maximised
    "highest": ("max_jump.yaml", [], "m"),
    "fastest": ("bound.yaml", [FAST], "m/s"),
}


def bound(what: str, model: Model) -> float:
    """What cannot be exceeded, generously.

    The highest: one push from crouched legs, in which the air gives its work at full force, and
    every hip its peak torque as far as it turns. The fastest: a foot that stands is passed at the
    motor's no-load speed at the length of a leg, faster only by what the piston stretches.
    """
    motor = next(e for e in model.effects if e.kind == "motor")
    hips = [c for c in model.mechanism.coordinates if c.name.endswith("hip/q")]
    if what == "fastest":
        return float(motor.value("w_noload")) * longest_leg(model.mechanism.need_robot())
    turned = sum(float(motor.value("tau_peak")) * (c.upper - c.lower) for c in hips)
    _, weight = inertia_and_weight(model)
    return model.mechanism.standing["body/z"] + (air_work(model) + turned) / weight


def planned(job: tuple[str, int, float]) -> dict[str, Any]:
    """What one start comes to."""
    what, seed, limit = job
    file, settings, _ = TASKS[what]
    task, document = load_task(file, [*settings, f"solver.time_limit={limit} s"])
    task = task.model_copy(update={"seed": seed, "guess_noise": SPREAD * (seed > 0)})
    found = plan(task, document)
    column = found.trajectory["body/z" if what == "highest" else "body/vx"]
    value = float(column[-1] if what == "highest" else column[0])
    return {"what": what, "seed": seed, "value": value, "refined": found.refined,
            "status": str(found.status), "cpu": found.solve_cpu_s}  # fmt: skip


def page(rows: Iterable[dict[str, Any]]) -> list[str]:
    """The table: a line for the highest jump and one for the fastest bound."""
    lines = ["| motion | starts | refined | best | median of these | bound |",
             "|---|---:|---:|---:|---:|---:|"]  # fmt: skip
    model = load_model("planning")
    for what, (file, _, unit) in TASKS.items():
        own = [row for row in rows if row["what"] == what]
        values = sorted(row["value"] for row in own if row["refined"])
        if values:
            told = f"{len(own)} | {len(values)} | {values[-1]:.2f} {unit} | "
            told += f"{values[len(values) // 2]:.2f} {unit} | {bound(what, model):.1f} {unit}"
            lines.append(f"| `{file}`, the {what} | {told} |")
    return [*lines, "", f"On {machine()}."]


def main() -> None:
    """Plan the starts that the record lacks; print or save the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=0, help="starts of each")
    parser.add_argument("--of", nargs="*", default=[*TASKS], choices=[*TASKS])
    parser.add_argument("--limit", type=float, default=120.0, help="s of a start")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--save", type=Path, help="page whose table is replaced")
    asked = parser.parse_args()
    record = Record(RECORD)
    have = record.known("what", "seed")
    jobs = [(what, seed, asked.limit) for seed in range(asked.count) for what in asked.of]
    with ProcessPoolExecutor(asked.jobs, get_context("spawn")) as pool:
        left = [pool.submit(planned, job) for job in jobs if job[:2] not in have]
        for done in as_completed(left):
            record.add(done.result())
    record.show(page(record.rows), asked.save, BEGIN, END)


if __name__ == "__main__":
    main()
