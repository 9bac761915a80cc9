"""Leaps planned with first-order chambers and with physical ones, each from nothing.

    python benchmarks/air.py --record air.jsonl [--part 1/2] [--limit 300]   # goes on where it ends
    python benchmarks/air.py --record air.jsonl --write                      # docs/solving.md

The ten forward jumps of benchmarks/quality.py, as `solve` plans them without memory. A plan is good
where its executions keep to what the task allows, on the simulated robot by the table alone or with
feedback.
"""

import argparse
import json
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from block import put_block
from quality import AHEAD, DISTANCES

from kemba.ocp import load_task
from kemba.solve import Approach, Listener, best_plan
from kemba.sweep import machine

MODELS = ("planning", "orifice")
PAGE = Path(__file__).parents[1] / "docs" / "solving.md"
MARKS = "<!-- air: written by benchmarks/air.py -->", "<!-- end of air -->"


def tried(model: str, use: tuple[float, float], distance: float, limit: float) -> dict[str, Any]:
    """One leap: whether it is good and how, where the plant ends, what it took."""
    asked = [f"duration={use[0]} s", f"supply={use[1]} MPa", f"distance={distance} m"]
    begin = time.process_time()
    task = load_task(
        "jump_forward.yaml", [*asked, f"model={model}", f"solver.time_limit={limit} s"]
    )
    made = best_plan(*task, Approach(), Listener())
    plant, feedback = made.result["plant_replay"], made.result.get("feedback")
    return {
        "model": model,
        "use": use,
        "distance": distance,
        "good": made.good,
        "feedback": feedback["by"] if feedback else None,
        "end_m": plant["final_error_m"] if plant else None,
        "trials": made.result["trials"],
        "cpu_s": time.process_time() - begin,
    }


def rows(record: Path) -> Iterator[str]:
    """Lines of the table."""
    listed = [json.loads(line) for line in record.read_text(encoding="utf-8").splitlines()]
    found = {(row["model"], tuple(row["use"]), row["distance"]): row for row in listed}
    yield "| leap | first-order chambers: good, end by the table | CPU s | physical ones | CPU s |"
    yield "|---|---|---:|---|---:|"
    for use in AHEAD:
        for distance in sorted(DISTANCES):
            cells = [_cells(found.get((model, use, distance))) for model in MODELS]
            yield f"| {distance} m, {use[1]} MPa | {' | '.join(cells)} |"
    counts = [[row["good"] for row in listed if row["model"] == model] for model in MODELS]
    told = " | ".join(f"{sum(good)} of {len(good)} | " for good in counts)
    yield f"| good | {told}|"


def _cells(row: dict[str, Any] | None) -> str:
    if row is None:
        return "not run |"
    by = f" by {row['feedback']}" if row["feedback"] else ""
    end = "falls" if row["end_m"] is None else f"{1e3 * row['end_m']:.0f} mm"
    return f"{'yes' + by if row['good'] else 'no'}, {end} | {row['cpu_s']:.0f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--record", type=Path, default=Path("air.jsonl"))
    parser.add_argument("--part", default="1/1", help="which share of the leaps")
    parser.add_argument("--limit", type=float, default=300.0, help="seconds of one plan")
    parser.add_argument("--write", action="store_true", help=f"into {PAGE.name}")
    asked = parser.parse_args()
    if asked.write:
        put_block(PAGE, *MARKS, [*rows(asked.record), "", f"On {machine()}."])
        return
    lines = asked.record.read_text(encoding="utf-8").splitlines() if asked.record.is_file() else []
    done = {(r["model"], tuple(r["use"]), r["distance"]) for r in map(json.loads, lines)}
    part, parts = map(int, asked.part.split("/"))
    every = [(m, use, d) for use in AHEAD for d in DISTANCES for m in reversed(MODELS)]
    for model, use, distance in every[part - 1 :: parts]:
        if (model, use, distance) in done:
            continue
        row = tried(model, use, distance, asked.limit)
        with asked.record.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(row) + "\n")
        print(model, use, distance, row["good"], f"{row['cpu_s']:.0f} s", flush=True)


if __name__ == "__main__":
    main()
