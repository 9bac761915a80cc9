"""Jumps on the spot as `solve` plans them, height by height: do they come true and land softly?

    python benchmarks/heights.py [--folder runs/heights]          # plans what is not there yet
    python benchmarks/heights.py --save benchmarks/pages/plan-quality.md      # writes the table

A run is kept in the folder; delete it to plan it anew.
"""

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from block import put_block

from kemba.ocp import load_task, task_model
from kemba.plant.certificate import rest_after, told
from kemba.plant.controller import execute
from kemba.plant.repeat import plant_of
from kemba.runs import load_run
from kemba.sweep import machine

HEIGHTS = (*(round(0.36 + 0.04 * i, 2) for i in range(14)), 0.9)  # m
SOLVE = "from kemba_cli.main import main; main()"
BEGIN = "<!-- heights: written by benchmarks/heights.py -->"
END = "<!-- end of heights -->"


def planned(height: float, folder: Path) -> Path:
    """The run of a height, made where it is missing."""
    out = folder / f"{height:.2f}"
    if not (out / "certificate.json").is_file():
        words = ["solve", "jump.yaml", "--set", f"height={height} m", "--out", str(out)]
        words += ["--no-memory", "--no-figure", "--quiet"]
        subprocess.run([sys.executable, "-c", SOLVE, *words], check=False)
    return out


def row(height: float, run: Path) -> dict[str, Any]:
    """What the table says of a run; `here`, `there`: the hardest impact of the landing on the
    plan's model and on the plant."""
    facts = json.loads((run / "certificate.json").read_text(encoding="utf-8"))
    kept, plant = load_run(run), plant_of(run)
    model = task_model(load_task(kept.task)[0])
    rest = rest_after(model, kept.trajectory, kept.controller)
    done = execute(kept.controller, plant, extra=rest)
    impacts = told(plant, done.run.impacts)
    apex = {
        name: float(motion.time[motion["body/z"].argmax()])
        for name, motion in (("here", kept.trajectory), ("there", done.trajectory))
    }
    return {
        "height": height,
        **{key: facts.get(key) for key in ("good", "start", "cost", "solve_cpu_s")},
        **{key: facts[key] for key in ("replay", "table_replay", "plant_replay")},
        "here": _hardest(facts["impacts"], apex["here"]),
        "there": _hardest(impacts, apex["there"]),
    }


def _hardest(impacts: list[dict[str, Any]], after: float) -> dict[str, Any]:
    landing = [i for i in impacts if i["time_s"] > after]
    return max(landing, key=lambda i: float(i["speed_m_s"]), default={})


def summary(rows: list[dict[str, Any]]) -> Iterator[str]:
    """The lines of the page."""
    yield f"Of {len(rows)} heights {sum(bool(r['good']) for r in rows)} are good."
    yield ""
    yield (
        "| height [m] | begun from | good | torque² | CPU s | table: apex [mm], touchdown [ms] "
        "| plant: apex [mm], touchdown [ms], end [mm] | hardest at landing [m/s]: plan, plant |"
    )
    yield "|---|---|---|---:|---:|---|---|---|"
    for r in rows:
        cells = (
            f"{r['height']:.2f}",
            str(r["start"]),
            "yes" if r["good"] else "no",
            f"{r['cost']['torque_squared_integral']:.3g}",
            f"{r['solve_cpu_s']:.0f}",
            _errors(r["table_replay"], ("apex", "touchdown")),
            _errors(r["plant_replay"], ("apex", "touchdown", "final")),
            ", ".join(f"{r[k]['speed_m_s']:.2f}" if r[k] else "none" for k in ("here", "there")),
        )
        yield "| " + " | ".join(cells) + " |"
    yield ""
    yield f"On {machine()}."


def _errors(facts: dict[str, Any] | None, names: tuple[str, ...]) -> str:
    keys = {"apex": "apex_error_m", "touchdown": "touchdown_error_s", "final": "final_error_m"}
    values = [(facts or {}).get(keys[name]) for name in names]
    return ", ".join("-" if value is None else f"{1e3 * value:+.1f}" for value in values)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--folder", type=Path, default=Path("runs/heights"))
    parser.add_argument("--save", type=Path, help="the page to write the table into")
    asked = parser.parse_args()
    lines = list(summary([row(h, planned(h, asked.folder)) for h in HEIGHTS]))
    if asked.save:
        put_block(asked.save, BEGIN, END, lines)
    print("\n".join(lines))


if __name__ == "__main__":
    main()
