"""kemba's relaxation schedule on programs with complementarity pairs from the literature.

    python benchmarks/mpcc_set.py [--starts 10] [--save benchmarks/pages/plan-quality.md]
    python benchmarks/mpcc_set.py --branches      # the best values, by all branches

*Solved*: no row, bound or product of a pair is violated by more than 1e-6, and the cost is within
1e-4 of the best known one, relative to it or to 1. The first start is the published one, or zero;
the others are normal around it with a standard deviation of 1. `--branches` solves the 2^n smooth
programs of a problem with n pairs, which gives the best value where these are convex.
"""

import argparse
import os
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from block import put_block
from mpcc.methods import METHODS
from mpcc.problem import Mpcc, branches, problems

from kemba.ocp.nlp.ipopt import Ipopt, Iterate
from kemba.sweep import machine

FEASIBLE, NEAR = 1e-6, 1e-4
FEW = 6  # pairs of problems whose branches are all solved
BEGIN, END = "<!-- mpcc: written by benchmarks/mpcc_set.py -->", "<!-- end of mpcc -->"


def starts(program: Mpcc, count: int) -> list[np.ndarray]:
    """The published start, and others around it."""
    rng = np.random.default_rng(0)
    noise = rng.normal(size=(count, len(program.start)))
    noise[0] = 0.0
    return [np.clip(program.start + n, program.lower, program.upper) for n in noise]


def judged(program: Mpcc, found: Iterate) -> tuple[bool, bool]:
    """Whether a point is feasible, and whether its cost is also near the best one."""
    feasible = program.violation(found.Y) <= FEASIBLE
    off = abs(program.cost(found.Y) - program.best) / max(1.0, abs(program.best))
    return feasible, feasible and off <= NEAR


def best_of_branches(name: str) -> float:
    """The least cost over all branches from the published start; infinite where none solves."""
    data, costs = problems()[name], [np.inf]
    for program in branches(name, data):
        found = Ipopt(program, {"max_iter": 300}).solve(Iterate(program.start), [0.0])
        if found.solved and program.violation(found.Y) <= FEASIBLE:
            costs.append(program.cost(found.Y))
    return min(costs)


def table(count: int) -> list[str]:
    """The lines of the page."""
    known = problems()
    figures = {method: np.zeros((len(known), count, 4)) for method in METHODS}
    for i, (name, data) in enumerate(known.items()):
        program = Mpcc(name, data)
        for method, solve in METHODS.items():
            for j, start in enumerate(starts(program, count)):
                begin = time.process_time()
                found = solve(program, start)
                cpu = time.process_time() - begin
                figures[method][i, j] = *judged(program, found), found.iterations, cpu
    lines = [
        "| method | solved from the published start | from all starts | feasible | problems "
        "solved from any start | iterations (median) | CPU s in all |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    for method, f in figures.items():
        solved, feasible = f[:, :, 1], f[:, :, 0]
        cells = (method, f"{solved[:, 0].sum():.0f} of {len(known)}", f"{solved.mean():.1%}",
                 f"{feasible.mean():.1%}", f"{solved.any(axis=1).sum():.0f}",
                 f"{np.median(f[:, :, 2]):.0f}", f"{f[:, :, 3].sum():.0f}")  # fmt: skip
        lines.append(f"| {' | '.join(cells)} |")
    first = next(iter(figures.values()))
    hard = [
        f"{name} ({first[i, :, 1].sum():.0f})" for i, name in enumerate(known) if not first[i, 0, 1]
    ]
    told = "Not solved by kemba's schedule from the published start (of all starts)"
    lines += ["", f"{len(known)} problems, {count} starts each. {told}: {', '.join(hard)}."]
    lines += ["", f"On {machine()}."]
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--starts", type=int, default=10)
    parser.add_argument("--branches", action="store_true")
    parser.add_argument("--save", type=Path, help="page whose table is replaced")
    asked = parser.parse_args()
    if asked.branches:
        for name, data in problems().items():
            if len(data["pairs"]) <= FEW:
                print(f"{name:14s} {data['best']:12.6g} {best_of_branches(name):12.6g}", flush=True)
        return
    lines = table(asked.starts)
    print("\n".join(lines))
    if asked.save is not None:
        put_block(asked.save, BEGIN, END, lines)


if __name__ == "__main__":
    main()
