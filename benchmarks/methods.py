"""The paper's penalty, one shot and ramped, beside relaxation, from the same cold start.

    python benchmarks/methods.py [TASK] [--nodes N] [--time-limit S]

Prints one row per method: how it ended, time, size, cost as a time integral, what is violated,
and how often valves switch. All methods start from the same automatic guess on the same grid.
"""

import argparse

import numpy as np

from kemba.ocp import Plan, load_task, plan
from kemba.sweep import machine

# Published (paper, section IV): IPOPT with HSL's MA86 on a laptop, N = 100.
PAPER = {"seconds": 55.0, "variables": 8982}
METHODS = {
    "penalty (eq. 9), one shot": ["method=penalty"],
    "penalty, ramped": ["method=penalty_ramped"],
    "relaxation, whole robot": ["method=relaxation", "solver.symmetry=false"],
    "relaxation, as shipped": ["method=relaxation"],
}
HEAD = (
    "| method | status | wall [s] | CPU [s] | iterations | variables | torque² [N²m²s] "
    "| complementarity | binary | switches |"
)


def row(name: str, found: Plan) -> str:
    """One line of the table."""
    certificate = found.certificate
    cost = found.cost["torque_squared_integral"]
    cells = [
        name,
        str(found.status),
        f"{found.solve_s:.1f}",
        f"{found.solve_cpu_s:.1f}",
        str(found.iterations),
        str(found.variables),
        f"{cost:.3g}",
        f"{certificate.complementarity:.1e}",
        f"{certificate.binary:.1e}",
        str(switches(found)),
    ]
    return f"| {' | '.join(cells)} |"


def switches(found: Plan) -> int:
    """How often valves switch, over all of them."""
    valves = [q.name for q in found.model.inputs.values() if q.binary]
    states = [np.round(found.trajectory[name][1:]) for name in valves]
    return int(sum(np.abs(np.diff(state)).sum() for state in states))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("task", nargs="?", default="jump.yaml")
    parser.add_argument("--nodes", type=int, default=100)
    parser.add_argument("--time-limit", type=float, default=600.0)
    asked = parser.parse_args()
    common = ["refine=none", f"nodes={asked.nodes}", f"solver.time_limit={asked.time_limit}"]
    print(f"{asked.task}, N = {asked.nodes}, {machine()}\n")
    print(HEAD)
    print("|---|---" + "|---:" * 8 + "|")
    for name, options in METHODS.items():
        task, document = load_task(asked.task, [*common, *options])
        print(row(name, plan(task, document)), flush=True)
    published = f"{PAPER['seconds']:.0f} | - | - | {PAPER['variables']}"
    print(f"| the paper's program, laptop, MA86 | published | {published} | - | - | - | - |")


if __name__ == "__main__":
    main()
