"""The cost of kemba's plans beside the authors' published ones, on like terms.

    python benchmarks/authors_plans.py --save benchmarks/pages/plan-quality.md

Like terms: what the authors' program asks, no hold, no clearance, no bound on impacts and no cost
of air; with their boom, whose weight they left out, and with kemba's. The cost is the time integral
of the squared hip torques. Theirs are read from the plans that they publish
(github.com/chrismailer/kemba-trajectory-optimisation).
"""

import argparse
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from block import put_block

from kemba.config import dump_yaml, load_yaml
from kemba.config.parsing import find_config
from kemba.ocp import load_task
from kemba.solve import Approach, Listener, best_plan
from kemba.sweep import machine

BEGIN, END = "<!-- authors: written by benchmarks/authors_plans.py -->", "<!-- end of authors -->"
# task, height [m], duration [s], the authors' torque-squared integral [N2.m2.s]
PLANS = (("jump", 0.5, 0.72, 1.44), ("jump", 0.7, 0.72, 2.99), ("max_jump", 1.0, 0.55, 9.82))
OURS = ("hold", "clearance", "folding", "landing")  # what their program does not know
# kg.m2: 0.887 kg on a lever of 2.493 m; no weight
THEIR_BOOM = {"boom": {"inertia": 5.513, "com": 0.0}}


def like_terms(name: str, height: float, duration: float, folder: Path) -> Path:
    """The shipped task with what the authors' program asks."""
    shipped: dict[str, Any] = load_yaml(find_config(name, "tasks")).data
    task = {key: value for key, value in shipped.items() if key not in OURS}
    task |= {"height": height, "duration": duration, "cost": {"torque_squared": 1}}
    task["bounds"] |= {"*/knee/z": {"at_least": 0.03}}
    task["goals"]["apex"].pop("maximise", None)
    path = folder / f"{name}_{height}.yaml"
    dump_yaml(task, path)
    return path


def planned(path: Path, starts: int, boom: dict[str, Any]) -> tuple[float, float]:
    """Torque-squared integral [N2.m2.s] of the cheapest of some starts, and its air [s]."""
    task, document = load_task(str(path))
    asked = task.model_copy(update={"effects": boom})
    approach = Approach(starts=starts, replay=False)  # the cheapest, whatever the plant does
    found = best_plan(asked, document, approach, Listener()).plan
    if not found.refined:
        return float("nan"), float("nan")
    return found.cost["torque_squared_integral"], found.cost["valve_open_s"]


def lines(starts: int) -> Iterator[str]:
    """The rows of the table."""
    yield (
        "| task | the authors' plan | kemba, their boom: torque², air [s] "
        "| kemba, with the boom's weight: torque², air [s] |"
    )
    yield "|---|---:|---:|---:|"
    with tempfile.TemporaryDirectory() as folder:
        for name, height, duration, theirs in PLANS:
            path = like_terms(name, height, duration, Path(folder))
            found = [planned(path, starts, boom) for boom in (THEIR_BOOM, {})]
            ours = " | ".join(f"{cost:.3g}, {air:.2f}" for cost, air in found)
            yield f"| {name}, {height:g} m | {theirs:g} | {ours} |"


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--starts", type=int, default=1, help="as of `solve`; 1 is the default")
    parser.add_argument("--save", type=Path, help="write the table into a page")
    asked = parser.parse_args()
    table = []
    for line in lines(asked.starts):
        print(line, flush=True)
        table.append(line)
    if asked.save is not None:
        put_block(asked.save, BEGIN, END, [*table, "", f"On {machine()}."])


if __name__ == "__main__":
    main()
