"""Plans made anew from an earlier run: with its solved program (stages.npz), and without it.

    python benchmarks/replan.py --write

Both ways in turns in one process, which has made such a plan before; CPU seconds, the median of
`--repeats` runs. *Plan* is what `solve --from` does until the plan stands; *all* has its table and
its executions as well.
"""

import argparse
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from block import printed, put_block

from kemba.ocp import load_task
from kemba.ocp.continuation.origin import Origin
from kemba.report.solving import solve_into
from kemba.runs import RunFolder
from kemba.solve import Approach, Listener, best_plan
from kemba.solve.earlier import origin_of
from kemba.solve.trial import Trial
from kemba.sweep import machine

CHANGES = {
    "jump.yaml": (
        *("height=0.55 m", "height=0.46 m", "height=0.60 m", "height=0.70 m"),
        *("supply=0.72 MPa", "supply=0.62 MPa", "payload=0.2 kg", "payload=0.5 kg"),
    ),
    "jump_forward.yaml": (
        *("distance=0.32 m", "distance=0.35 m", "distance=0.25 m"),
        *("height=0.52 m", "supply=0.72 MPa", "payload=0.2 kg"),
    ),
}
PAGE = Path(__file__).resolve().parents[1] / "docs" / "learn.md"
BEGIN, END = "<!-- plans made anew: written by benchmarks/replan.py -->", "<!-- end of plans -->"
HEAD = (
    "| from the shipped task | good | iterations | CPU s: plan, all | squared torque "
    "| from the nodes: iterations | CPU s: plan, all | squared torque |",
    "|---|---|---:|---:|---:|---:|---:|---:|",
)


@dataclass(frozen=True)
class Taken:
    """A plan made anew, and what it took in all [CPU s]."""

    made: Trial
    seconds: float

    @property
    def row(self) -> str:
        """Iterations, seconds and cost as cells of a table."""
        plan = self.made.plan
        cost = plan.cost["torque_squared_integral"]
        spent = f"{plan.solve_cpu_s + plan.build_s:.2f}, {self.seconds:.2f}"
        return f"{plan.iterations} | {spent} | {cost:.3g}"


def made(task: str, change: str, origin: Origin) -> Taken:
    """The plan for a changed figure, as `solve --from` makes and executes it."""
    resolved, document = load_task(task, [change])
    begun = time.process_time()
    found = best_plan(resolved, document, Approach(origin=origin), Listener())
    return Taken(found, time.process_time() - begun)


def rows(repeats: int, folder: Path) -> Iterator[str]:
    """Lines of the table."""
    for task, changes in CHANGES.items():
        resolved, document = load_task(task)
        run = RunFolder.create(folder / resolved.name, resolved.name)
        solve_into(run, resolved, document, Listener(), figure=False)
        kept = origin_of(run.path)
        ways = kept, replace(kept, stages=None)
        for change in changes:
            found: list[list[Taken]] = [[], []]
            for _ in range(1 + repeats):
                for way, taken in zip(ways, found, strict=True):
                    taken.append(made(str(run.path / "task.yaml"), change, way))
            own, nodes = (_middle(taken[1:]) for taken in found)
            good = "yes" if own.made.good else "no"
            name = f"{resolved.name}, {change.replace('=', ' ')}"
            yield f"| {name} | {good} | {own.row} | {nodes.row} |"


def _middle(taken: list[Taken]) -> Taken:
    """The one of median duration."""
    return sorted(taken, key=lambda one: one.seconds)[len(taken) // 2]


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=3, help="of which the median is shown")
    parser.add_argument("--write", action="store_true", help="put the table into docs/learn.md")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        lines = printed(rows(options.repeats, Path(folder)))
    if options.write:
        put_block(PAGE, BEGIN, END, [*HEAD, *lines, "", f"On {machine()}."])


if __name__ == "__main__":
    main()
