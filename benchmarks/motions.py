"""How far every shipped motion is planned and certified, on three robots.

    python benchmarks/motions.py                        # all that the record lacks
    python benchmarks/motions.py --robot hound --motion bound platform
    python benchmarks/motions.py --save benchmarks/pages/plan-quality.md

The shipped robot, `hound`, and `whippet` (benchmarks/whippet): one made for the studies alone,
shorter and lighter, with legs called bow and stern. Each task says the same with the robot's own
legs. Everything from a guess, as `solve` plans it, without memory, within `--limit` seconds of the
wall clock.
"""

import argparse
import os
import tempfile
import time
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from block import Record

from kemba.config import dump_yaml, shipped_configs
from kemba.config.reader import read
from kemba.errors import KembaError
from kemba.ocp import load_task
from kemba.solve import Approach, Listener, best_plan
from kemba.sweep import machine

RECORD = Path(__file__).with_name("motions.jsonl")
WHIPPET = Path(__file__).parent / "whippet" / "whippet.yaml"
BEGIN, END = "<!-- written by benchmarks/motions.py -->", "<!-- end of motions -->"
LEGS = {
    "kemba": {"front": "front", "rear": "rear"},
    "hound": {"front": "fore", "rear": "hind"},
    "whippet": {"front": "bow", "rear": "stern"},
}
LONGER = {"kemba": 1.0, "hound": 0.290 / 0.261, "whippet": 0.9}  # where feet stand
STEPS = ("planned", "refined", "replay", "table_replay", "plant_replay", "good")
HEADS = ("a plan on nodes", "refined", "by its inputs", "by its table", "plant, open loop", "good")


def shipped(folder: str, name: str) -> dict[str, Any]:
    """A shipped YAML file as data."""
    return dict(read(shipped_configs(folder)[f"{name}.yaml"].read_text()).data)


def renamed(data: Any, legs: dict[str, str]) -> Any:
    """The data of a task with other names of legs."""
    if isinstance(data, dict):
        return {renamed(key, legs): renamed(value, legs) for key, value in data.items()}
    if isinstance(data, list):
        return [renamed(value, legs) for value in data]
    if isinstance(data, str):
        for old, new in legs.items():
            data = data.replace(f"{old}/", f"{new}/")
            data = new if data == old else data
    return data


PLACES = ("distance", "from", "to", "*/foot/x", "at_least", "at_most")


def placed(data: Any, longer: float) -> Any:
    """The data of a scene, or of where feet may stand in it, with places along x `longer`."""
    if isinstance(data, dict):
        return {key: placed(value, longer) if key in PLACES or isinstance(value, dict) else value
                for key, value in data.items()}  # fmt: skip
    return f"{longer * float(data.removesuffix(' m')):.3f} m"


def written(motion: str, robot: str, folder: Path) -> Path:
    """The task's file for a robot in `folder`; those of a sequence beside it."""
    task = renamed(shipped("tasks", motion), LEGS[robot])
    if "terrain" in task or "obstacles" in task:  # they stand where this robot's feet do
        task["distance"] = placed(task["distance"], LONGER[robot])
        for key in ("terrain", "obstacles"):
            task[key] = [placed(line, LONGER[robot]) for line in task.get(key, ())]
        for moment in ("start", "end"):
            feet = placed(task[moment]["*/foot/x"], LONGER[robot])
            task[moment] = task[moment] | {"*/foot/x": feet}
    if robot != "kemba":
        base = task.get("model", "planning")
        model = {} if base == "planning" else shipped("models", base)
        named = str(WHIPPET) if robot == "whippet" else robot
        model |= {"name": robot, "base": "planning", "robot": named}
        task["model"] = f"own-{base}.yaml"
        dump_yaml(model, folder / task["model"])
    for part in task.get("sequence", ()):
        name = part if isinstance(part, str) else part["motion"]
        written(Path(name).stem, robot, folder)
    file = folder / f"{motion}.yaml"
    dump_yaml(task, file)
    return file


def answered(file: Path, limit: float) -> dict[str, Any]:
    """How far `solve` brings a task."""
    began = time.process_time()
    try:
        best = best_plan(
            *load_task(str(file), [f"solver.time_limit={limit} s"]), Approach(), Listener()
        )
    except KembaError as error:
        return {"refused": str(error), "cpu": time.process_time() - began}
    verdicts = best.judged.verdicts if best.judged else {}
    return {
        "planned": bool(best.plan.status.plan), "refined": best.plan.refined,
        **{name: name in verdicts and verdicts[name].good for name in STEPS[2:5]},
        "good": best.good, "cost": best.plan.cost.get("torque_squared_integral"),
        "start": best.plan.start, "cpu": time.process_time() - began,
        "sentence": best.result["sentence"],
    }  # fmt: skip


def page(rows: Iterable[dict[str, Any]], motions: Iterable[str]) -> list[str]:
    """The table: a line for every robot and motion."""
    known = {(row["robot"], row["motion"]): row for row in rows}
    lines = [f"| robot | motion | {' | '.join(HEADS)} | torque² [N².m².s] | CPU s |",
             f"|---|---|{'---|' * len(HEADS)}---:|---:|"]  # fmt: skip
    for robot in LEGS:
        for row in (known[robot, motion] for motion in motions if (robot, motion) in known):
            told = ["yes" if row.get(step) else "no" for step in STEPS]
            cost = f"{row['cost']:.2f}" if row.get("cost") else ""
            cells = [robot, f"`{row['motion']}`", *told, cost, f"{row['cpu']:.0f}"]
            lines.append(f"| {' | '.join(cells)} |")
    good = sum(bool(row.get("good")) for row in known.values())
    on = Counter(row["machine"] for row in known.values())
    told = ", ".join(f"{name} ({count} rows)" for name, count in on.items())
    return [*lines, "", f"Good: {good} of {len(known)}. On {told}."]


def main() -> None:
    """Plan what was not planned yet; print or save the table."""
    motions = [path.stem for path in shipped_configs("tasks").values()]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robot", nargs="*", default=[*LEGS], choices=[*LEGS])
    parser.add_argument("--motion", nargs="*", default=motions, choices=motions)
    parser.add_argument("--limit", type=float, default=300.0, help="s of a motion")
    parser.add_argument("--save", type=Path, help="page whose table is replaced")
    asked = parser.parse_args()
    record = Record(RECORD)
    have = record.known("robot", "motion")
    wanted = [(robot, motion) for robot in asked.robot for motion in asked.motion]
    for robot, motion in wanted if asked.save is None else ():
        if (robot, motion) in have:
            continue
        with tempfile.TemporaryDirectory() as folder:
            file = written(motion, robot, Path(folder))
            found = answered(file, asked.limit)
        told = {"robot": robot, "motion": motion, "limit": asked.limit, "machine": machine()}
        record.add(told | found)
    record.show(page(record.rows, motions), asked.save, BEGIN, END)


if __name__ == "__main__":
    main()
