"""What moving a table's valve edges takes and brings: python benchmarks/retiming.py.

Plans of random heights, supplies and distances. Errors are of the table on the plan's own model,
as rounded and as written, in units of what needs no search: 0.5 mm of apex, 1 ms of touchdown,
1 cm of the end.
"""

import os
from collections.abc import Iterator
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from kemba.ocp import controller_table, load_task
from kemba.plant import retiming
from kemba.solve import Approach, Listener, best_plan
from kemba.sweep import machine


def tasks() -> Iterator[tuple[str, list[str]]]:
    """The tasks: 16 heights, 6 of another supply, 6 distances, two shipped tasks."""
    rng = np.random.default_rng(5)
    for height in rng.uniform(0.36, 0.9, 16):
        yield "jump.yaml", [f"height={height:.3f} m"]
    for height, supply in zip(rng.uniform(0.4, 0.8, 6), rng.uniform(0.63, 0.78, 6), strict=True):
        yield "jump.yaml", [f"height={height:.3f} m", f"supply={supply:.3f} MPa"]
    for distance in rng.uniform(0.05, 0.6, 6):
        yield "jump_forward.yaml", [f"distance={distance:.3f} m"]
    yield from (("hop.yaml", []), ("max_jump.yaml", []))


def main() -> None:
    """Print the table."""
    errors: list[float] = []
    execute = retiming.executed_table

    def noted(*given: Any, **named: Any) -> retiming.ExecutedTable:
        found = execute(*given, **named)
        errors.append(found.error)
        return found

    retiming.executed_table = noted
    print("| task | as rounded | as written | executions |\n|---|---:|---:|---:|")
    counts = []
    for name, changes in tasks():
        found = best_plan(*load_task(name, changes), Approach(replay=False), Listener()).plan
        table = controller_table(found.model, found.trajectory, found.task.hold)
        errors.clear()
        retiming.retimed(found.model, found.trajectory, table)
        counts.append(len(errors))
        words = " ".join([name, *changes])
        print(f"| {words} | {errors[0]:.2f} | {min(errors):.2f} | {len(errors)} |", flush=True)
    print(f"\n{sum(counts)} executions of {len(counts)} tables, on {machine()}.")


if __name__ == "__main__":
    main()
