"""What feedback brings to plans that their table alone does not keep to.

    for d in 0.1 0.2 0.3 0.45 0.6; do kemba-opt solve jump_forward.yaml --set "distance=$d m" \
        --set "duration=0.75 s" --set "supply=0.7 MPa" --out "forward/$d-0.7"; done
    python benchmarks/feedback.py forward/* [--draws 40] [--write]

A row of the page docs/policy.md for each run: the table alone on the task's plant, then in how many
of three executions with other noise of sensors and valves the plan is kept to, as `solve` judges
it, by each way of feedback, with the end of the worst from its place. `--draws`: also how many of
so many draws of twice.yaml land, and end in place.
"""

import argparse
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from block import printed, put_block

from kemba.errors import KembaError
from kemba.model import Model
from kemba.ocp import load_task, task_model
from kemba.plant.certificate import rest_after
from kemba.plant.controller import Execution, execute
from kemba.plant.repeat import VALVE_SCATTER, plant_of
from kemba.policy.execute import execute_policy
from kemba.policy.player import Policy
from kemba.policy.write import write_policy
from kemba.runs import Run, load_run
from kemba.scenarios.draw import scenarios, standing
from kemba.scenarios.feedback import UNCERTAINTIES, WAYS
from kemba.solve.feedback import PLAYED
from kemba.solve.judged import landing_speed
from kemba.solve.verdict import allowances, judge
from kemba.sweep import machine

PAGE = Path(__file__).parents[1] / "docs" / "policy.md"
MARKS = "<!-- feedback: written by benchmarks/feedback.py -->", "<!-- end of feedback -->"


class Trials:
    """A run, its policy, and executions of it."""

    def __init__(self, path: Path, folder: Path) -> None:
        self.run: Run = load_run(path)
        self.task = load_task(self.run.task)[0]
        model, self.plant = task_model(self.task), plant_of(path)
        self.plan, self.table = self.run.trajectory, self.run.controller
        self.rest = rest_after(model, self.plan, self.table)
        self.file = write_policy(model, self.table, folder / "policy.npz")
        speed = landing_speed(self.plan)
        self.allowed = allowances(self.task.tolerances, speed)["plant_replay"]

    def played(
        self, way: str, plant: Model, seed: int, start: dict[str, float] | None = None
    ) -> Execution:
        """One execution; by the table alone without noise, as its commands know no sensor."""
        if way == "neither":
            return execute(self.table, plant, extra=self.rest, start=start)
        policy, noisy = Policy(self.file, *WAYS[way]), (True, VALVE_SCATTER, seed)
        return execute_policy(self.table, policy, plant, self.rest, start, 1e-3, *noisy)

    def kept(self, way: str) -> tuple[int, float]:
        """How many executions keep to the plan, and the worst end [m]."""
        count = 1 if way == "neither" else PLAYED
        done = [
            self.played(way, self.plant, i).against(self.plant, self.plan) for i in range(count)
        ]
        good = [judge("", one, self.allowed, same_model=False).good for one in done]
        return sum(good), max(one.final_error_m for one in done)

    def drawn(self, way: str, count: int) -> tuple[int, int]:
        """In how many draws the plan lands, and ends in place."""
        landed = ended = 0
        for seed, case in enumerate(scenarios(UNCERTAINTIES, self.plant, count)):
            start = standing(case.model, self.table, case.start)
            try:
                done = self.played(way, case.model, seed, start).against(case.model, self.plan)
            except KembaError:
                continue  # it cannot be simulated
            landed += done.landed
            ended += done.landed and done.final_error_m <= self.allowed.final
        return landed, ended


def rows(runs: list[Path], draws: int) -> Iterator[str]:
    """Lines of the table."""
    ways = ("neither", *(way for way in WAYS if way != "neither"))
    yield f"| run | {' | '.join(('controller.csv alone', *ways[1:]))} |"
    yield "|---" * (1 + len(ways)) + "|"
    for path in runs:
        with tempfile.TemporaryDirectory() as folder:
            trials, cells = Trials(path, Path(folder)), []
            for way in ways:
                good, end = trials.kept(way)
                word = ("no", "yes")[good] if way == "neither" else f"{good} of {PLAYED}"
                cells.append(f"{word}, {1e3 * end:.0f} mm")
                if draws:
                    landed, ended = trials.drawn(way, draws)
                    cells[-1] += f"; {landed} and {ended} of {draws}"
        yield f"| {path.name} | {' | '.join(cells)} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs", nargs="+", type=Path)
    parser.add_argument("--draws", type=int, default=0)
    parser.add_argument("--write", action="store_true", help=f"into {PAGE.name}")
    asked = parser.parse_args()
    lines = printed(rows(asked.runs, asked.draws))
    if asked.write:
        put_block(PAGE, *MARKS, [*lines, "", f"On {machine()}."])


if __name__ == "__main__":
    main()
