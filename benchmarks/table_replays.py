"""How near a table comes to its plan: python benchmarks/table_replays.py [--save docs/plant.md].

Every task is planned as `solve` does it, and its table executed on the plan's own model through
eq. 10 and the dead time. *Before landing* is the largest distance between planned and executed
centre of the body until the first of both touches down, or over the whole plan where none does.
"""

import argparse
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from block import put_block

from kemba.events import EXECUTED, PLANNED, read
from kemba.model import Model
from kemba.ocp import load_task
from kemba.plant.certificate import rest_after
from kemba.plant.controller import execute
from kemba.plant.replay import Replay
from kemba.solve import Approach, Listener, best_plan
from kemba.sweep import machine
from kemba.trajectory import Trajectory

HEIGHTS = (*(round(0.36 + 0.02 * i, 2) for i in range(28)), 0.45)  # m
TASKS: tuple[tuple[str, ...], ...] = (
    *(("jump.yaml", f"height={height} m") for height in sorted(HEIGHTS)),
    *((name,) for name in ("hop.yaml", "drop.yaml", "stand.yaml", "max_jump.yaml")),
    *(("jump_forward.yaml", f"distance=0.{tenths} m") for tenths in range(1, 7)),
)
MARKS = ("<!-- tables: written by benchmarks/table_replays.py -->", "<!-- end of tables -->")
ASKED = {"apex": 1.0, "before landing": 2.0, "touchdown": 2.0}  # mm, mm, ms


def before_landing(model: Model, plan: Trajectory, real: Trajectory) -> float:
    """The largest distance [m] of the body from the plan before either lands."""
    weight, clock = model.mechanism.weight, plan.time - plan.time[0]
    courses = read(plan, PLANNED, weight, clock), read(real, EXECUTED, weight)
    ends = [float(clock[-1]), *(course.landing for course in courses)]
    flown = (real.time >= 0.0) & (real.time < min(ends))
    away = [
        np.interp(real.time[flown], clock, plan[name]) - real[name][flown]
        for name in ("body/x", "body/z")
    ]
    return float(np.hypot(*away).max())


def errors(words: Sequence[str]) -> dict[str, float | None]:
    """Errors of a task's table [mm, ms] and whether the plan is good."""
    made = best_plan(*load_task(words[0], words[1:]), Approach(), Listener())
    found, table = made.plan, made.motions.table
    assert table is not None
    rest = rest_after(found.model, found.trajectory, table)
    done: Replay = execute(table, found.model, extra=rest).against(found.model, found.trajectory)
    late = done.touchdown_error_s
    told: dict[str, Any] = {
        "good": made.good,
        "apex": 1e3 * done.apex_error_m,
        "before landing": 1e3 * before_landing(found.model, found.trajectory, done.trajectory),
        "touchdown": None if late is None else 1e3 * late,
    }
    return told


def table(rows: Sequence[tuple[str, dict[str, Any]]]) -> Iterator[str]:
    """The lines of the page."""
    for name, most in ASKED.items():
        sizes = {task: abs(row[name]) for task, row in rows if row[name] is not None}
        worst = max(sizes, key=lambda task: sizes[task])
        unit = "ms" if name == "touchdown" else "mm"
        within = sum(size <= most for size in sizes.values())
        yield (
            f"- {name}: {within} of {len(sizes)} within {most:g} {unit}, "
            f"at most {sizes[worst]:.2f} {unit} (`{worst}`)"
        )
    yield ""
    yield "| task | good | apex [mm] | before landing [mm] | touchdown [ms] |"
    yield "|---|---|---:|---:|---:|"
    for task, row in rows:
        cells = ("-" if row[name] is None else f"{row[name]:+.2f}" for name in ASKED)
        yield f"| {task} | {'yes' if row['good'] else 'no'} | {' | '.join(cells)} |"
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
        rows.append((name, errors(words)))
        print(*rows[-1], flush=True)
    lines = list(table(rows))
    if asked.save:
        put_block(asked.save, *MARKS, lines)
    print("\n".join(lines))


if __name__ == "__main__":
    main()
