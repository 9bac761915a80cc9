"""Jumps planned with and without what makes planning quick, in turns.

    python benchmarks/variants.py [--block forward] [--cases 16]

Prints means over the first cases of a block of the reliability sweep: iterations, those in which
IPOPT shifted the Hessian and so factorised more than once, the cost (geometric), and the processor
time as a ratio to what is shipped.
"""

import argparse
import re
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from unittest.mock import patch

import numpy as np

from kemba.config import parse
from kemba.ocp import Task, load_task, plan
from kemba.ocp.functions import problem
from kemba.ocp.nlp.ipopt import Iterate, warm
from kemba.ocp.relaxation.schedule import find, interior
from kemba.ocp.relaxation.session import Schedule
from kemba.ocp.relaxation.settings import Ends, Relaxation, Starts
from kemba.ocp.transcription.transcribe import Parameters
from kemba.sweep import expand, load_sweep, machine


@dataclass(frozen=True)
class Variant:
    """What a variant changes: figures of classes and modules, the task's solver, whether whole
    robots grow from half."""

    figures: dict[object, dict[str, object]] = field(default_factory=dict)
    solver: dict[str, object] = field(default_factory=dict)
    grown: bool = True
    ladder: tuple[float, ...] = ()  # relaxations of the pairs solved before the first


SHIPPED = Variant()
VARIANTS: dict[str, dict[str, Variant]] = {
    "forward": {
        "as shipped": SHIPPED,
        "from the guess": Variant(grown=False),
        "plain Hessian": Variant({problem: {"REGULARISATION": 0.0}}),
        "changed plans at their bounds": Variant({Starts: {"changed": 1e-6}}),
        "memory by IPOPT's default": Variant(solver={"options": {"mumps_mem_percent": 1000}}),
    },
    "jumps": {
        "as shipped": SHIPPED,
        "pairs relaxed by 1, 0.1 and 0.01 before": Variant(ladder=(1.0, 0.1, 0.01)),
        "pairs relaxed by 0.01 at first": Variant({Relaxation: {"loose": 1e-2}}),
        "changed plans at their bounds": Variant({Starts: {"changed": 1e-6}}),
    },
}
ITERATION = re.compile(r"^ *\d+r?(?: +\S+){5} +(\S+)(?: +\S+){3}$", re.MULTILINE)  # lg(rg)


def jumps(block: str, count: int) -> Iterator[Task]:
    """The first tasks of a block of the sweep."""
    sweep, document = load_sweep("reliability.yaml")
    cases = [case for case in expand(sweep, document, Path()) if case.block == block]
    return (parse(case.work["task"], Task) for case in cases[:count])


def from_loose(schedule: Schedule, start: Iterate, ladder: tuple[float, ...]) -> Iterate:
    """The schedule's first steps after looser pairs, from loose to tight as `solve_mpcc` does."""
    options, point = interior(), start
    for eps in ladder:
        parameters = Parameters(eps, forces=Relaxation.forces)
        point = schedule.solve(f"pairs by {eps:g}", point, parameters, options=options)
        options = warm(min(Starts.interior_mu, eps), 1e-2, tol=Ends.tol)
    return find(schedule, point)


def figures(task: Task, variant: Variant) -> list[float]:
    """Iterations, those shifted, logarithm of the cost and CPU seconds of one cold solve."""
    solver = task.solver.model_copy(update=variant.solver)
    with tempfile.TemporaryDirectory() as folder, ExitStack() as patches:
        if variant.ladder:
            longer = partial(from_loose, ladder=variant.ladder)
            patches.enter_context(patch("kemba.ocp.planner.find", longer))
        log = Path(folder) / "solver.log"
        for owner, values in variant.figures.items():
            patches.enter_context(patch.multiple(owner, **values))
        if not variant.grown:
            patches.enter_context(patch("kemba.ocp.planner.Planner.half", None))
        found = plan(task.model_copy(update={"solver": solver}), log=log)
        shifts = ITERATION.findall(log.read_text(encoding="utf-8"))
    cost = found.cost["torque_squared_integral"]
    shifted = sum(shift != "-" for shift in shifts)
    return [found.iterations, shifted, np.log(cost), found.solve_cpu_s]


def set_by(name: str) -> tuple[str, list[str]]:
    """A task and what is set: `jump.yaml:height=0.6`."""
    task, *settings = name.split(":")
    return task, settings


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--block", choices=VARIANTS, default="forward")
    parser.add_argument("--cases", type=int, default=16)
    parser.add_argument("--tasks", nargs="+", help="shipped tasks in the place of the sweep's")
    parser.add_argument("--variants", nargs="+", help="some of the block's, the first of all too")
    asked = parser.parse_args()
    variants = VARIANTS[asked.block]
    if asked.variants:
        variants = {
            name: v for name, v in variants.items() if v is SHIPPED or name in asked.variants
        }
    tasks = [load_task(*set_by(name))[0] for name in asked.tasks or ()]
    tasks = tasks or list(jumps(asked.block, asked.cases))
    found = [[figures(task, variant) for variant in variants.values()] for task in tasks]
    iterations, shifted, cost, seconds = np.moveaxis(np.array(found), -1, 0)  # (cases, variants)
    print(f"{len(tasks)} tasks of the block {asked.block}, {machine()}\n")
    print("| variant | iterations | shifted | cost [N².m².s] | CPU time |\n|---|" + "---:|" * 4)
    for k, name in enumerate(variants):
        ratio = seconds[:, k].sum() / seconds[:, 0].sum()
        means = f"{iterations[:, k].mean():.0f} | {shifted[:, k].mean():.0f}"
        print(f"| {name} | {means} | {np.exp(cost[:, k].mean()):.3g} | {ratio:.2f} |")


if __name__ == "__main__":
    main()
