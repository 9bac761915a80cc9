"""Solve time against the number of nodes, with the fitted exponent.

    python benchmarks/scaling.py [--save scaling.png] [--nodes 50 100]

Prints the median CPU time of all solves of a plan, refined and executed as by default, how many
times the median the longest one took, and the exponent p of time ~ N^p. Aims: p at most 1.1, and
no solve above 3 times the median. `--refine none` measures plans of implicit Euler.
"""

import argparse
import os
from collections.abc import Mapping, Sequence

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the CLI does

import numpy as np
from matplotlib.figure import Figure

from kemba.ocp import load_task
from kemba.plotting.style import BLUE, VERMILLION, key_above, paper_figure, paper_style, save_figure
from kemba.solve import Approach, Listener, best_plan
from kemba.sweep import machine

NODES = (50, 100, 200, 400)
TASKS = ("jump.yaml", "jump_forward.yaml")  # half robot first; whole robot
CHANGES: Sequence[list[str]] = (
    [],
    ["height=0.48 m"],
    ["height=0.53 m", "supply=0.73 MPa"],
    ["payload=0.2 kg"],
    ["supply=0.68 MPa", "payload=0.1 kg"],
)


@paper_style
def plot_growth(
    sizes: np.ndarray, seconds: Mapping[str, np.ndarray], exponents: Mapping[str, float]
) -> Figure:
    """Solve times [s] over numbers of nodes by task, with fitted powers of N."""
    figure = paper_figure(3.0, 4.2)
    axes = figure.add_subplot()
    for index, (name, times) in enumerate(seconds.items()):
        hue = (BLUE, VERMILLION)[index % 2]
        exponent = exponents[name]
        axes.loglog(sizes, times, "o", ms=4, color=hue, label=f"{name}: N^{exponent:.2f}")
        level = np.exp(np.mean(np.log(times) - exponent * np.log(sizes)))
        axes.loglog(sizes, level * np.asarray(sizes, dtype=float) ** exponent, color=hue)
    axes.set_xticks(sizes, [str(size) for size in sizes], minor=False)
    axes.minorticks_off()
    axes.set_xlabel("nodes N")
    axes.set_ylabel("solve time [s]")
    key_above(axes)
    return figure


def seconds(name: str, nodes: int, asked: argparse.Namespace) -> list[float]:
    """CPU times [s] of the solves that end in a plan, also in one that misses a tolerance."""
    times = []
    fixed = [f"refine={asked.refine}", f"nodes={nodes}", f"solver.time_limit={asked.time_limit}"]
    for changes in CHANGES[: asked.repeats]:
        found = best_plan(*load_task(name, [*fixed, *changes]), Approach(), Listener()).plan
        took = f"{name:20s} N = {nodes:4d}  {found.solve_cpu_s:7.2f} s"
        print(f"{took}  {found.iterations:5d} iterations  {found.sentence}", flush=True)
        if found.status.plan:
            times.append(found.solve_cpu_s)
    return times


def exponent(nodes: Sequence[int], times: np.ndarray) -> float:
    """The power of N that fits the times; NaN where fewer than two are known."""
    known = np.isfinite(times)
    if known.sum() < 2:
        return np.nan
    return float(np.polyfit(np.log(np.array(nodes)[known]), np.log(times[known]), 1)[0])


def _cell(times: Sequence[float]) -> str:
    """The median, and how many times that the longest took."""
    if not times:
        return "no plan"
    median = float(np.median(times))
    return f"{median:.2f} s (longest {max(times) / median:.1f} x)"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--save", default="scaling.png")
    parser.add_argument("--repeats", type=int, help="of the changes: only the first")
    parser.add_argument("--refine", choices=("radau", "none"), default="radau")
    parser.add_argument("--time-limit", type=float, default=300.0)
    parser.add_argument("--nodes", type=int, nargs="+", default=NODES)
    asked = parser.parse_args()
    print(machine())
    solves = {
        name.removesuffix(".yaml"): [seconds(name, nodes, asked) for nodes in asked.nodes]
        for name in TASKS
    }
    measured = {
        name: np.array([np.median(times) if times else np.nan for times in own])
        for name, own in solves.items()
    }
    powers = {name: exponent(asked.nodes, times) for name, times in measured.items()}
    print("| task |" + "".join(f" N = {nodes} |" for nodes in asked.nodes) + " exponent |")
    print("|---|" + "---:|" * (len(asked.nodes) + 1))
    for name, own in solves.items():
        cells = "".join(f" {_cell(times)} |" for times in own)
        print(f"| {name} |{cells} {powers[name]:.2f} |")
    print(save_figure(plot_growth(np.array(asked.nodes), measured, powers), asked.save))


if __name__ == "__main__":
    main()
