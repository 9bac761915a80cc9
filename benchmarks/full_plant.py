"""Logs of the full plant against the planning model: what `discover` makes of five model errors
at once.

    python benchmarks/full_plant.py            # all sets, about 2 CPU minutes each
    python benchmarks/full_plant.py --sets 1 --logs FOLDER --progress
    python benchmarks/full_plant.py --write    # into benchmarks/pages; finished sets are kept

Each set is three plans, played on the plant and logged at 1 kHz with the usual noise, and
two more that are not learnt from. The plant (configs/models/plant.yaml) has orifice chambers, a
supply line, a lag of the valves, seal friction, damping, a leak and cushions, none of which the
planning model has. Kept of each set, in a file: verdict, ladder of held-out errors in units of the
noise, figures found, CPU seconds, and what `compare` says of the kept logs under the planning
model, the plant's own and the model that was written.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

import numpy as np
from blind import report
from full_plant_page import page

from kemba.identify.answer import Answer
from kemba.identify.discover import discover
from kemba.identify.robot.problem import robot_problem
from kemba.identify.workflow import compare_logs, write_answer
from kemba.model import load_model
from kemba.ocp import load_task, plan
from kemba.plant.commands import Commands, JointControl, Profile
from kemba.plant.controller import Gains
from kemba.plant.repeat import Sensors, take_log
from kemba.plant.simulate import run
from kemba.trajectory import Trajectory

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "benchmarks" / "pages" / "full-plant.md"
SETS = (  # tasks whose plans are learnt from, and tasks to judge by
    (("hop", "jump height=0.4 m", "jump"), ("jump height=0.54 m", "jump height=0.43 m")),
    (
        ("jump height=0.56 m", "jump_forward distance=0.2 m", "jump height=0.76 m"),
        ("jump height=0.58 m", "jump_forward distance=0.15 m"),
    ),
    (
        ("jump height=0.8 m", "jump_forward", "jump height=0.42 m"),
        ("jump height=0.82 m", "jump_forward distance=0.25 m"),
    ),
    (
        ("jump height=0.36 m", "jump height=0.6 m", "jump height=0.74 m"),
        ("jump height=0.38 m", "jump height=0.62 m"),
    ),
)
LIKELY = (
    *("chambers:orifice", "supply_scale", "rise_time_scale", "supply_droop", "hose_lag"),
    *("seal_friction", "piston_damping", "quadratic_damping", "end_cushion", "cross_leak"),
    *("both_mode_loss", "valve_delay", "payload", "boom_force"),
)
Say = Callable[[str], None]


def followed(plan: Trajectory) -> JointControl:
    """The hips' controller (paper, eq. 10) with the plan's references at 1 kHz."""
    joints = ("front/hip", "rear/hip")
    times = np.arange(0.0, plan.time[-1] - plan.time[0], 1e-3)
    t = plan.time - plan.time[0]
    wanted = [[np.interp(times, t, plan[f"{j}/{x}"]) for x in ("q", "w", "tau")] for j in joints]
    limits = np.array([[24.8, 49.7, np.inf]] * len(joints))
    gains = Gains()
    return JointControl(joints, times, np.moveaxis(wanted, -1, 0), limits, gains.K_p, gains.K_d)


def plant_log(asked: str, rest: float = 0.2) -> Trajectory:
    """A log of the full plant that plays the plan of a task, and `rest` [s] after it."""
    name, _, change = asked.partition(" ")
    motion = plan(*load_task(f"{name}.yaml", [change] if change else [])).trajectory
    rng = np.random.default_rng([7, *asked.encode()])
    time = motion.time - motion.time[0]
    valves = {n: Profile.of(time, np.round(motion[n])) for n in motion.names if "/valve/" in n}
    placed = ("body/x", "body/z", "body/pitch", *(n for n in motion.names if n.endswith("/q")))
    start = {n: float(motion[n][0]) for n in placed}
    sensors, duration = Sensors.usual(), float(time[-1]) + rest
    commands, times = Commands(valves, followed(motion)), sensors.times(duration, rng)
    truth = run(load_model("plant"), start, commands, duration, None, times).trajectory
    log = take_log(truth, sensors, rng)
    log.meta["name"] = asked
    return log


def written(folder: Path, number: int) -> tuple[list[Path], list[Path]]:
    """Files of a set: logs to learn from, and logs to judge by."""
    files = {
        name: folder / f"{name.replace(' ', '-')}.csv" for names in SETS[number] for name in names
    }
    for name, path in files.items():
        plant_log(name).write(path)
    fitted, kept = ([files[name] for name in names] for names in SETS[number])
    return fitted, kept


def answered(
    fitted: list[Path], kept: list[Path], among: Collection[str] | None, say: Say, out: Path
) -> Answer:
    """The answer from the planning model on, written to `out`; `among`: effects that are looked
    for (None: all)."""
    model = load_model("planning")
    logs, others = ([Trajectory.read(path) for path in paths] for paths in (fitted, kept))
    problem, judge = robot_problem(logs, model, among), robot_problem(others, model)
    answer = discover(problem, judge, say=say).answer
    write_answer(answer, out, "planning")
    return answer


def study(number: int, folder: Path, among: Collection[str] | None, say: Say) -> dict[str, Any]:
    """The record of one set."""
    fitted, kept = written(folder, number)
    begin = time.process_time()
    answer = answered(fitted, kept, among, say, folder / "answer")
    spent = time.process_time() - begin
    models = {"planning": "planning", "plant": "plant"}
    models |= {"found": answer.model} if answer.model else {}
    compared = {name: compare_logs(kept, model)[0].noise_ratio for name, model in models.items()}
    return {
        "set": number,
        "likely": among is not None,
        "seconds": spent,
        "answer": answer.json() | {"model": None},  # where it was written is of no use later
        "compare": compared,
    }


def main() -> None:
    """Read the arguments, run the sets that are not in the file, and print the table of all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, nargs="+", default=list(range(len(SETS))))
    parser.add_argument("--out", type=Path, default=ROOT / "benchmarks" / "full_plant.jsonl")
    parser.add_argument("--logs", type=Path, help="keep logs and models here")
    parser.add_argument("--progress", action="store_true")
    parser.add_argument("--likely", action="store_true", help="only the effects named in LIKELY")
    parser.add_argument("--write", action="store_true", help="put the table into the docs")
    given = parser.parse_args()
    say: Say = (lambda text: print("  ", text, flush=True)) if given.progress else lambda _: None
    done = {(r["set"], r["likely"]) for r in report.read(given.out)}
    with tempfile.TemporaryDirectory() as scratch:
        for number in (n for n in given.sets if (n, given.likely) not in done):
            folder = (given.logs or Path(scratch)) / f"set{number}"
            folder.mkdir(parents=True, exist_ok=True)
            record = study(number, folder, LIKELY if given.likely else None, say)
            report.append(given.out, record)
            print(f"set {number}: {record['answer']['sentence']}", flush=True)
    records = [r for r in report.read(given.out) if r["likely"] == given.likely]
    names = {number: [*fitted, *kept] for number, (fitted, kept) in enumerate(SETS)}
    text = page(sorted(records, key=lambda r: r["set"]), names)
    print(text)
    if given.write:
        report.write(DOCS, "full plant", text)


if __name__ == "__main__":
    main()
