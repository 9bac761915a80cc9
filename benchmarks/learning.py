"""The loop counted in jumps: python benchmarks/learning.py --machines 40 --record learning.jsonl

Hidden machines (benchmarks/hidden_machines.py) execute the shipped jump. Three ways to come nearer
to it, three rounds of three jumps each: `learn` as the command does it, iterative learning alone
(the correction of kemba/rounds on the model as it is), and a plain least-squares fit of all
parameters at once. Every finished way of a machine is kept in the record; an interrupted study
goes on, `--part 1/2` with every second machine. `--page` only writes the section of docs/learn.md.

A hundred others, every second one with air that flows through orifices, and two rounds of `learn`:

    python benchmarks/learning.py --mixed --machines 100 --record learning_mixed.jsonl
"""

import argparse
import json
import os
import shutil
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from block import put_block
from hidden_machines import HiddenMachine, machine
from learning_page import mixed, section
from scipy.optimize import lsq_linear

from kemba.config import dump_yaml
from kemba.errors import KembaError
from kemba.identify.adopt import item
from kemba.identify.logs.reading import read_logs
from kemba.identify.robot.problem import robot_problem
from kemba.model import load_spec
from kemba.ocp import load_task, task_model
from kemba.ocp.certificate.status import Status
from kemba.plant.certificate import rest_after
from kemba.plant.controller import execute
from kemba.plotting.source import load_machine
from kemba.report.solving import solve_into
from kemba.rounds.correction import Aim, correction_from, flight_of
from kemba.rounds.round import Asked, learn
from kemba.runs import RunFolder, load_run
from kemba.solve import Approach, Listener
from kemba.solve.earlier import origin_of
from kemba.sweep.farm import machine as this_computer

PAGE = Path(__file__).resolve().parents[1] / "docs" / "learn.md"
MARKS = ("<!-- machines: written by benchmarks/learning.py -->", "<!-- end of machines -->")
MIXED = ("<!-- mixed machines: written by benchmarks/learning.py --mixed -->",
         "<!-- end of mixed machines -->")  # fmt: skip
ROUNDS = 3
SEED, OTHERS = 7000, 7100

MOST = 10.0  # sizes by which the plain fit may change a parameter, so that the model can be built
LIMIT = 40.0  # s for a plan of the plain fit, whose models are far from any; usual plans take 2 s
UNSEEN, TINY = 1e-3, 1e-9  # weight that keeps what shows nowhere at zero; so that bounds differ

Step = Callable[[Path, list[Path], Path], dict[str, Any]]  # run, all its logs, new run


def by_learning(run: Path, logs: list[Path], new: Path) -> dict[str, Any]:
    """One round of `kemba-opt learn`: the newest run and its logs."""
    task = str(load_run(run).task)
    folder = RunFolder.create(new, "jump", [*logs])
    found = learn(Asked([run], logs[-3:], task), folder, Listener())
    folder.finish("finished" if found.good else "failed")
    band = found.next_expected
    return {
        "verdict": found.answer.verdict,
        "added": list(found.answer.added),
        "good": found.good,
        "expected_m": [band.low, band.high] if band else None,
    }


def by_correction(run: Path, logs: list[Path], new: Path) -> dict[str, Any]:
    """Iterative learning alone: the same plan and model, valve edges moved."""
    here = load_run(run)
    task = load_task(here.task)[0]
    model, robot = task_model(task), load_machine(task.model)
    executed = [flight_of(log, robot) for log in read_logs(logs[-3:])]
    rest = rest_after(model, here.trajectory, here.controller)
    simulated = flight_of(execute(here.controller, model, extra=rest).trajectory, robot)
    correction = correction_from(executed, simulated)
    plain = run.parent / "run-0"
    aimed = Aim(model, robot, here.trajectory, correction).corrected(load_run(plain).controller)
    shutil.copytree(plain, new)
    table = load_run(plain).controller
    columns = {h: aimed.table[n] for h, n in zip(table.headers, table.names, strict=True)}
    type(table)(table.time, columns, table.meta).write(new / "controller.csv")
    return {"correction_m": correction.apex, "moved": aimed.moved}


def by_least_squares(run: Path, logs: list[Path], new: Path) -> dict[str, Any]:
    """Every parameter of every effect that may be missing in one linear fit, then a new plan."""
    first = run.parent / "run-0"
    task, document = load_task(load_run(first).task)
    problem = robot_problem(read_logs(logs), task_model(task))
    effects = {name: c for name, c in problem.candidates.items() if not c.sensor}
    names = [*problem.nuisance, *(c.key for c in effects.values())]
    leads = [c.lead for c in effects.values()]
    count = len(problem.nuisance)
    size = np.array([*(sigma for _, sigma in problem.nuisance.values()), *(p.size for p in leads)])
    low = np.r_[np.full(count, -MOST), [max(-MOST, (p.lower - p.off) / p.size) for p in leads]]
    high = np.r_[np.full(count, MOST), [min(MOST, (p.upper - p.off) / p.size) for p in leads]]
    r, jacobian = problem.residual({}), problem.jacobian({}, names)
    matrix = np.vstack([jacobian * size, UNSEEN * np.eye(len(names))])
    right = np.concatenate([-r, np.zeros(len(names))])
    found = lsq_linear(matrix, right, (low - TINY, high + TINY)).x * size
    listed = []
    for (name, candidate), step in zip(effects.items(), found[count:], strict=True):
        lead = candidate.lead
        value = float(np.clip(lead.off + step, lead.lower, lead.upper))
        values = {**candidate.typical(), candidate.key: value}
        listed.append(item(name, _as_listed(candidate, values)))
    model = new.parent / f"{new.name}.yaml"
    dump_yaml({"name": "all", "base": task.model, "effects": listed}, model)
    load_spec(str(model))
    limited = task.solver.model_copy(update={"time_limit": LIMIT})
    task = task.model_copy(update={"model": str(model), "solver": limited})
    folder = RunFolder.create(new, "jump", [*logs])
    approach = Approach(origin=origin_of(first), replay=False)
    result = solve_into(folder, task, document, Listener(), approach, figure=False)
    folder.finish("finished")
    if result["status"] not in (Status.SOLVED, Status.ACCEPTABLE):  # nobody would execute it
        (new / "controller.csv").unlink(missing_ok=True)
    return {"status": result["status"], "effects": len(listed)}


def _as_listed(candidate: Any, values: dict[str, float]) -> dict[str, dict[str, float]]:
    """Parameters as a model's list has them: what is searched as 1/value the other way round."""
    told = {}
    for key, value in values.items():
        name = key.rsplit(".", 1)[1]
        if name in candidate.reciprocal:
            name, value = candidate.reciprocal[name][0], 1.0 / max(value, 1e-9)
        told[name] = {"value": value}
    return told


WAYS: dict[str, Step] = {
    "learn": by_learning,
    "correction": by_correction,
    "least squares": by_least_squares,
}


def study(hidden: HiddenMachine, way: str, first: Path, folder: Path, last: int) -> dict[str, Any]:
    """Rounds up to the `last` of one way on one machine: apexes of jumps, and what was learnt."""
    began = time.process_time()
    run, logs, rounds, facts = folder / "run-0", [], [], []
    shutil.copytree(first, run)
    for number in range(last + 1):
        jumps = hidden.jumps(run, folder / f"logs-{number}", number)
        rounds.append({"apex_m": [j.apex for j in jumps],
                       "apex_error_m": [j.apex_error for j in jumps],
                       "landed": [j.landed for j in jumps]})  # fmt: skip
        logs += [jump.log for jump in jumps]
        if number == last:
            break
        new = folder / f"run-{number + 1}"
        try:
            facts.append(WAYS[way](run, logs, new))
        except KembaError as error:
            facts.append({"failed": str(error)})
        if (new / "controller.csv").is_file() and facts[-1].get("good", True):
            run = new
        else:  # no new plan that may go to the robot: the old one is executed again
            shutil.rmtree(new, ignore_errors=True)
    return {"rounds": rounds, "facts": facts, "cpu_s": time.process_time() - began}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--machines", type=int, default=40)
    parser.add_argument("--part", default="1/1", help="which share of the machines")
    parser.add_argument("--ways", nargs="*", choices=WAYS, default=list(WAYS))
    parser.add_argument("--record", type=Path, default=Path("learning.jsonl"))
    parser.add_argument("--run", type=Path, help="plan to begin with; jump.yaml solved anew")
    parser.add_argument("--keep", type=Path, help="where runs and logs are kept")
    parser.add_argument("--page", action="store_true", help="only write the section")
    parser.add_argument("--mixed", action="store_true", help="the hundred others")
    asked = parser.parse_args()
    begin, last, ways = (OTHERS, 2, ["learn"]) if asked.mixed else (SEED, ROUNDS, asked.ways)
    rows = _read(asked.record)
    if not asked.page:
        with tempfile.TemporaryDirectory() as scratch:
            room = asked.keep or Path(scratch)
            first = asked.run or _planned(room / "first")
            done = {(row["seed"], row["way"]) for row in rows}
            part, parts = map(int, asked.part.split("/"))
            for seed in range(begin, begin + asked.machines)[part - 1 :: parts]:
                missing = [way for way in ways if (seed, way) not in done]
                chambers = "orifice" if asked.mixed and seed % 2 else "first_order"
                trial = room / f"{seed}" / "trial"
                hidden = machine(seed, first, trial, chambers) if missing else None
                for way in missing:
                    assert hidden is not None
                    folder = room / f"{seed}" / way.replace(" ", "-")
                    shutil.rmtree(folder, ignore_errors=True)
                    found = study(hidden, way, first, folder, last)
                    kinds = {e["kind"]: e["parameters"] for e in hidden.effects}
                    row = {"seed": seed, "way": way, "size": hidden.size, "chambers": chambers,
                           "effects": kinds, "machine": this_computer(), **found}  # fmt: skip
                    rows.append(row)
                    with asked.record.open("a", encoding="utf-8") as stream:
                        stream.write(json.dumps(row) + "\n")
                    print(_told(row), flush=True)
    put_block(PAGE, *(MIXED if asked.mixed else MARKS), [(mixed if asked.mixed else section)(rows)])


def _planned(out: Path) -> Path:
    task, document = load_task("jump.yaml")
    folder = RunFolder.create(out, "jump", [])
    solve_into(folder, task, document, Listener(), figure=False)
    folder.finish("finished")
    return out


def _told(row: dict[str, Any]) -> str:
    errors = [f"{1e3 * np.mean(r['apex_error_m']):+.1f}" for r in row["rounds"]]
    kept = "kept" if all(all(r["landed"]) for r in row["rounds"]) else "lost"
    told = f"{row['seed']} {row['way']}: {' '.join(errors)} mm"
    return f"{told}, landings {kept}, {row['cpu_s']:.0f} s"


def _read(path: Path) -> list[dict[str, Any]]:
    if not path.is_file():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


if __name__ == "__main__":
    main()
