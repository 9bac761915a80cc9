"""Plans without and with pulses put in where the multipliers say that they pay.

    python benchmarks/insertion.py --write    # the table of docs/solving.md

Each task is planned from its first guess twice, as it is and without pulses: cost in the task's
own weights, phases, CPU seconds.
"""

import os
import time
from collections.abc import Iterator
from pathlib import Path
from unittest.mock import patch

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from block import table_of_tasks

from kemba.ocp import load_task
from kemba.ocp.certificate.certify import objective
from kemba.ocp.planning import Planning
from kemba.ocp.refinement.repair import FAILS

TASKS = (
    *(("jump.yaml", f"height={h} m") for h in (0.43, 0.5, 0.6, 0.7, 0.8)),
    ("jump.yaml", "height=0.71 m", "supply=0.66 MPa"),
    ("jump.yaml", "height=0.57 m", "payload=0.3 kg"),
    ("jump.yaml", "height=0.5 m", "model=hound"),
    *(("jump_forward.yaml", f"distance={d} m") for d in (0.2, 0.33, 0.5)),
    ("popup.yaml",),
    ("max_jump_land.yaml",),
)
PAGE = Path(__file__).resolve().parents[1] / "docs" / "solving.md"
BEGIN, END = "<!-- pulses: written by benchmarks/insertion.py -->", "<!-- end of pulses -->"
HEAD = ("| task | without: cost, phases | CPU s | with | CPU s |", "|---|---|---:|---|---:|")


def planned(name: str, changes: list[str], pulses: bool) -> str:
    """Cost and phases of the first plan, and its seconds, as cells of a table."""
    task, document = load_task(name, changes)
    began = time.process_time()
    with patch("kemba.ocp.refinement.repair.FAILS", FAILS if pulses else 0):
        made = next(Planning.of(task, document).plans())
    seconds = time.process_time() - began
    if not made.refined or made.stages is None:
        return f"not refined | {seconds:.1f}"
    cost = objective(made.model, made.task, made.requirements, made.trajectory)
    return f"{cost:.3g}, {len(made.stages.phases)} | {seconds:.1f}"


def rows(count: int | None) -> Iterator[str]:
    """The lines of the table, after a plan that is not counted: it loads what all need."""
    planned("jump.yaml", [], pulses=True)
    for name, *changes in TASKS[:count]:
        told = " ".join([Path(name).stem, *changes])
        cells = [planned(name, changes, pulses) for pulses in (False, True)]
        yield f"| `{told}` | {cells[0]} | {cells[1]} |"


if __name__ == "__main__":
    table_of_tasks(__doc__, PAGE, (BEGIN, END), HEAD, rows)
