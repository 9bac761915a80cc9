"""Solve time against the number of nodes, with the fitted exponent.

    python benchmarks/scaling.py [--save docs/scaling.png] [--repeats 3] [--nodes 50 100]

Prints the median CPU time of cold solves from slightly different guesses, not refined, and the
exponent p of time ~ N^p. Aim: p at most 1.1.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np

from kemba.ocp import load_task, plan
from kemba.plotting import plot_growth, save_figure
from kemba.sweep import machine

NODES = (50, 100, 200, 400)
TASKS = ("jump.yaml", "jump_forward.yaml")  # half robot first; whole robot


def seconds(name: str, nodes: int, repeats: int, limit: float) -> float:
    """Median CPU time [s] of the cold solves that end in a plan, also in one whose feet touch the
    ground for a moment where `clearance` forbids it; NaN when none does."""
    times = []
    for seed in range(repeats):
        noise = ["guess_noise=0.02", f"seed={seed}"] if seed else []
        options = ["refine=none", f"nodes={nodes}", f"solver.time_limit={limit}", *noise]
        found = plan(*load_task(name, options))
        print(
            f"{name:20s} N = {nodes:4d}  {found.solve_cpu_s:7.2f} s  {found.sentence}", flush=True
        )
        if found.status.plan:
            times.append(found.solve_cpu_s)
    return float(np.median(times)) if times else np.nan


def exponent(nodes: Sequence[int], times: np.ndarray) -> float:
    """The power of N that fits the times; NaN where fewer than two are known."""
    known = np.isfinite(times)
    if known.sum() < 2:
        return np.nan
    return float(np.polyfit(np.log(np.array(nodes)[known]), np.log(times[known]), 1)[0])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--save", default="scaling.png")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--time-limit", type=float, default=300.0)
    parser.add_argument("--nodes", type=int, nargs="+", default=NODES)
    asked = parser.parse_args()
    print(machine())
    measured = {
        name.removesuffix(".yaml"): np.array(
            [seconds(name, nodes, asked.repeats, asked.time_limit) for nodes in asked.nodes]
        )
        for name in TASKS
    }
    powers = {name: exponent(asked.nodes, times) for name, times in measured.items()}
    print("| task |" + "".join(f" N = {nodes} |" for nodes in asked.nodes) + " exponent |")
    print("|---|" + "---:|" * (len(asked.nodes) + 1))
    for name, times in measured.items():
        cells = "".join(f" {value:.2f} s |" for value in times)
        print(f"| {name} |{cells} {powers[name]:.2f} |")
    print(save_figure(plot_growth(np.array(asked.nodes), measured, powers), asked.save))


if __name__ == "__main__":
    main()
