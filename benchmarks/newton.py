"""Forward jumps with and without what makes their Newton steps few or cheap, in turns.

    python benchmarks/newton.py [--cases 8]

Prints means over the first cases of the reliability sweep's whole robots: iterations, those in
which IPOPT shifted the Hessian and so factorised more than once, the cost (geometric), and the
processor time as a ratio to what is shipped.
"""

from __future__ import annotations

import argparse
import re
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from unittest.mock import patch

import numpy as np

from kemba.config import parse
from kemba.ocp import Task, plan
from kemba.sweep import expand, load_sweep, machine

VARIANTS: dict[str, tuple[dict[str, float], dict[str, int]]] = {  # constants, options of IPOPT
    "as shipped": ({}, {}),
    "undamped": ({"damped.DAMPING": 0.0}, {}),
    "changed plans at their bounds": ({"schedule.CHANGED": 1e-6}, {}),
    "memory by IPOPT's default": ({}, {"mumps_mem_percent": 1000}),
}
ITERATION = re.compile(r"^ *\d+r?(?: +\S+){5} +(\S+)(?: +\S+){3}$", re.MULTILINE)  # lg(rg)


def jumps(count: int) -> Iterator[Task]:
    """The first tasks of the sweep's whole robots."""
    sweep, document = load_sweep("reliability.yaml")
    cases = [case for case in expand(sweep, document, Path()) if case.block == "general"]
    return (parse(case.work["task"], Task) for case in cases[:count])


def figures(task: Task, constants: dict[str, float], options: dict[str, int]) -> list[float]:
    """Iterations, those shifted, logarithm of the cost and CPU seconds of one cold solve."""
    solver = task.solver.model_copy(update={"options": options})
    with tempfile.TemporaryDirectory() as folder, ExitStack() as patches:
        log = Path(folder) / "solver.log"
        for name, value in constants.items():
            patches.enter_context(patch(f"kemba.ocp.{name}", value))
        found = plan(task.model_copy(update={"solver": solver}), log=log)
        shifts = ITERATION.findall(log.read_text(encoding="utf-8"))
    cost = found.cost["torque_squared_integral"]
    shifted = sum(shift != "-" for shift in shifts)
    return [found.iterations, shifted, np.log(cost), found.solve_cpu_s]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=8)
    asked = parser.parse_args()
    found = [[figures(task, *v) for v in VARIANTS.values()] for task in jumps(asked.cases)]
    iterations, shifted, cost, seconds = np.moveaxis(np.array(found), -1, 0)  # (cases, variants)
    print(f"{asked.cases} forward jumps, {machine()}\n")
    print("| variant | iterations | shifted | cost [N².m².s] | CPU time |\n|---|" + "---:|" * 4)
    for k, name in enumerate(VARIANTS):
        ratio = seconds[:, k].sum() / seconds[:, 0].sum()
        means = f"{iterations[:, k].mean():.0f} | {shifted[:, k].mean():.0f}"
        print(f"| {name} | {means} | {np.exp(cost[:, k].mean()):.3g} | {ratio:.2f} |")


if __name__ == "__main__":
    main()
