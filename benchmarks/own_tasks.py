"""Tasks of one's own: other poses, bounds and models.

    python benchmarks/own_tasks.py --write    # the table of docs/continuing.md

Each task is planned as `solve` plans it, without memory: CPU seconds of plan, table and
executions, and whether the plan is good.
"""

import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from block import table_of_tasks

from kemba.ocp import load_task
from kemba.solve import Approach, Listener, best_plan

# The task, what is changed in it, and effects that its model is given.
TASKS = (
    ("jump.yaml", ("start.front/hip/q=-1.1 rad", "start.rear/hip/q=1.1 rad"), ""),
    ("jump.yaml", ("start.*/piston/x=15 mm",), ""),
    ("jump.yaml", ("start.body/x=0.2 m",), ""),
    ("jump.yaml", ("end.*/piston/x=20 mm",), ""),
    ("jump.yaml", ("landing.impact_speed=0.5 m/s",), ""),
    ("jump.yaml", ("height=0.45 m", "clearance=2 cm"), ""),
    ("jump.yaml", ("height=0.7 m", "min_dwell=20 ms"), ""),
    ("jump.yaml", ("effects.contact.mu=0.5",), ""),
    ("jump.yaml", (), "{kind: boom_force, F: 10 N}"),
    ("jump.yaml", (), "{kind: seal_friction, F_c: 11.5 N}"),
    ("jump_forward.yaml", ("landing.impact_speed=0.5 m/s",), ""),
    ("jump_forward.yaml", ("bounds.body/pitch={at_least: -5 deg, at_most: 5 deg}",), ""),
    ("jump_forward.yaml", ("start.front/hip/q=-1.2 rad", "start.rear/hip/q=1.2 rad"), ""),
    (
        "jump_forward.yaml",
        (
            "start.front/hip/q=-1.13 rad",
            "start.rear/hip/q=1.27 rad",
            "start.body/pitch={at_least: -3 deg, at_most: 3 deg}",
        ),
        "",
    ),
    ("jump_forward.yaml", (), "{kind: boom_force, F: 10 N}"),
    ("jump_forward.yaml", (), "{kind: seal_friction, F_c: 11.5 N}"),
)
PAGE = Path(__file__).resolve().parents[1] / "docs" / "continuing.md"
BEGIN, END = "<!-- own tasks: written by benchmarks/own_tasks.py -->", "<!-- end of own tasks -->"
HEAD = (
    "| changed | good | torque² [N².m².s] | CPU s |",
    "|---|---|---:|---:|",
)


def planned(name: str, changes: list[str]) -> str:
    """Whether the plan is good, its squared torque and its seconds, as cells of a table."""
    task, document = load_task(name, changes)
    began = time.process_time()
    made = best_plan(task, document, Approach(), Listener())
    seconds = time.process_time() - began
    torque = made.plan.cost["torque_squared_integral"]
    return f"{'yes' if made.good else 'no'} | {torque:.3g} | {seconds:.1f}"


def rows(count: int | None) -> Iterator[str]:
    """The lines of the table, with a first plan that is not counted: it loads what all need."""
    planned("jump.yaml", [])
    with tempfile.TemporaryDirectory() as folder:
        for name, changes, effect in TASKS[:count]:
            own = list(changes)
            if effect:
                model = Path(folder, "learnt.yaml")
                model.write_text(f"base: planning\neffects:\n  - {effect}\n", encoding="utf-8")
                own.append(f"model={model}")
            told = ", ".join(changes) or f"its model has {effect}"
            yield f"| `{name.removesuffix('.yaml')}`, {told} | {planned(name, own)} |"


if __name__ == "__main__":
    table_of_tasks(__doc__, PAGE, (BEGIN, END), HEAD, rows)
