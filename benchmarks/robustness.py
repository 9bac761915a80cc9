"""How often shipped plans land under uncertainty: python benchmarks/robustness.py [TASK ...].

Plans each task as `kemba-opt solve` does, draws conditions from `configs/uncertainties`, and
executes the plan's table on the full plant: open loop, and with its feedback policy. Every
execution is kept in a record; what is there of the same table is not executed again, so that an
interrupted run continues. A task may carry changes: "jump height=0.6 m, supply=0.6 MPa". The page,
benchmarks/pages/robustness.md, is written from the record.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from repeats import drawn
from robustness_page import PICTURE, page

from kemba.config import shipped_folder
from kemba.errors import KembaError
from kemba.files import atomic_text, sha256
from kemba.model import Model
from kemba.ocp import load_task, task_model
from kemba.plant.certificate import rest_after
from kemba.plant.controller import Execution, execute
from kemba.plant.repeat import plant_of
from kemba.policy.execute import execute_policy
from kemba.policy.player import Policy
from kemba.policy.write import FILE
from kemba.runs import Run, load_run
from kemba.scenarios.draw import Scenario, scenarios, standing
from kemba.scenarios.feedback import policy_of
from kemba.sweep.farm import machine

TASKS = ("jump", "jump_forward", "hop", "stand", "drop", "max_jump")
WAYS = {  # how a table is executed, under which uncertainties
    "usual": ("usual", "open loop"),
    "twice": ("twice", "open loop"),
    "feedback": ("twice", "feedback"),
}
CARD = Path(__file__).resolve().parent.parent / "benchmarks" / "pages" / "robustness.md"
KEYS = ("task", "conditions", "way", "of", "drawn", "index")  # what names an execution
SOLVE = "from kemba_cli.main import main; main()"


@dataclass(frozen=True)
class Bench:
    """A planned task: its run, the plant that it is executed on, and what its plan asks."""

    name: str
    run: Run
    model: Model  # of the plan
    plant: Model

    @property
    def table(self) -> Path:
        return self.run.path / "controller.csv"


def _parts(words: str) -> tuple[str, list[str]]:
    """The task of some words, and its changes."""
    task, *changes = words.split(" ", 1)
    return task, changes[0].split(", ") if changes else []


def _folder_of(words: str, folder: Path) -> Path:
    task, changes = _parts(words)
    return folder / "-".join([task, *(c.replace(" ", "") for c in changes)])


def planned(words: str, folder: Path, anew: bool) -> Bench:
    """The plan of a task with its changes, from `folder` where it is there."""
    task, changes = _parts(words)
    out = _folder_of(words, folder)
    if anew and out.exists():
        shutil.rmtree(out)
    if not (out / "controller.csv").is_file():
        options = [word for change in changes for word in ("--set", change)]
        call = ["solve", f"{task}.yaml", *options, "--out", str(out), "--no-figure", "--quiet"]
        subprocess.run([sys.executable, "-c", SOLVE, *call], check=False)
    run = load_run(out)
    return Bench(words, run, task_model(load_task(run.task)[0]), plant_of(out))


def executed(bench: Bench, case: Scenario, way: str, seed: int) -> Execution:
    """One execution of a plan under the conditions of a scenario."""
    table, plan = bench.run.controller, bench.run.trajectory
    rest, start = rest_after(bench.model, plan, table), standing(case.model, table, case.start)
    if way == "open loop":
        return execute(table, case.model, extra=rest, start=start)
    policy = Policy(bench.run.path / FILE)
    return execute_policy(table, policy, case.model, rest, start, noise=True, seed=seed)


def records(
    bench: Bench, file: str, way: str, cases: range, drawn: int, known: set[tuple[Any, ...]]
) -> Iterator[dict[str, Any]]:
    """What happens in those of the `drawn` executions that are not known yet."""
    policy = bench.run.path / FILE if way == "open loop" else policy_of(bench.run.path)
    parts = [bench.table, shipped_folder("uncertainties") / f"{file}.yaml"]
    parts += [policy] if way != "open loop" else []
    what = "".join(sha256(part)[:8] for part in parts)
    drawn_cases = scenarios(file, bench.plant, drawn)
    for index in cases:
        case = drawn_cases[index]
        facts = {"task": bench.name, "conditions": file, "way": way, "of": what, "drawn": drawn,
                 "index": index}  # fmt: skip
        if tuple(facts.values()) in known:
            continue
        began = time.process_time()
        try:
            found = executed(bench, case, way, index).against(case.model, bench.run.trajectory)
        except KembaError as error:
            yield {**facts, "fault": f"cannot be simulated: {error}", "values": dict(case.values)}
            continue
        yield {
            **facts,
            "fault": found.fault or "",
            "apex_error_m": found.apex_error_m,
            "touchdown_error_s": found.touchdown_error_s,
            "final_error_m": found.final_error_m,
            "cpu_s": time.process_time() - began,
            "values": dict(case.values),
        }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tasks", nargs="*", default=list(TASKS))
    parser.add_argument("--ways", nargs="*", choices=WAYS, default=list(WAYS)[:3])
    parser.add_argument("--drawn", type=int, default=240, help="conditions that are drawn")
    parser.add_argument("--cases", type=int, help="of these so many are executed; all of them")
    parser.add_argument("--folder", type=Path, default=Path("runs/robustness"))
    parser.add_argument("--replan", action="store_true", help="make the plans anew")
    parser.add_argument("--page", action="store_true", help="only write the page")
    parser.add_argument("--out", type=Path, default=CARD)
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    kept = asked.folder / "record.jsonl"
    rows = _read(kept)
    if not asked.page:
        known = {tuple(row[key] for key in KEYS) for row in rows}
        for name in asked.tasks:
            bench = planned(name, asked.folder, asked.replan)
            for way in asked.ways:
                cases = range(asked.cases or asked.drawn)
                for row in records(bench, *WAYS[way], cases, asked.drawn, known):
                    rows.append({**row, "machine": machine(), "on": date.today().isoformat()})
                    with kept.open("a", encoding="utf-8") as stream:
                        stream.write(json.dumps(rows[-1]) + "\n")
                here = (name, *WAYS[way])
                own = [r for r in rows if (r["task"], r["conditions"], r["way"]) == here]
                print(name, way, len(own), sum(not r["fault"] for r in own), flush=True)
    jump = asked.folder / "jump"
    told = drawn(jump, asked.out.parent / PICTURE) if jump.is_dir() else ""
    with atomic_text(asked.out) as stream:
        stream.write(page(rows, told, _costs(rows, asked.folder)))
    print(asked.out)


def _costs(rows: list[dict[str, Any]], folder: Path) -> dict[str, float]:
    """The squared torque of every task whose run is in the folder."""
    found = {}
    for name in dict.fromkeys(row["task"] for row in rows):
        file = _folder_of(name, folder) / "certificate.json"
        if file.is_file():
            facts = json.loads(file.read_text(encoding="utf-8"))
            found[name] = float(facts["cost"]["torque_squared_integral"])
    return found


def _read(path: Path) -> list[dict[str, Any]]:
    if not path.is_file():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


if __name__ == "__main__":
    main()
