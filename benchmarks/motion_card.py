"""Motions drawn at random, that nothing was tuned on: how many are planned, and how many are good?

    python benchmarks/motion_card.py --count 2 --seed 63          # two of each kind
    python benchmarks/motion_card.py --count 20 --seed 63         # goes on where the record ends
    python benchmarks/motion_card.py --save benchmarks/pages/plan-quality.md

Platforms, hurdles, strides, chains of jumps and slopes, each with its own supply pressure, payload
and leg lengths, planned as `solve` plans them, without memory, within `--limit` seconds. *Refined*
is a plan that keeps to its own equations between nodes; *good* is one whose replays and execution
on the simulated robot keep to it. A draw that is proved impossible is told apart.
"""

import argparse
import os
import random
import tempfile
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from block import Record
from motions import answered, shipped

from kemba.config import dump_yaml

RECORD = Path(__file__).with_name("motion_card.jsonl")
BEGIN, END = "<!-- written by benchmarks/motion_card.py -->", "<!-- end of motion card -->"


def platform(rng: random.Random) -> tuple[dict[str, Any], str]:
    """Onto or off a platform."""
    height = round(rng.uniform(-0.3, 0.2), 3)
    task = shipped("tasks", "platform" if height > 0 else "drop_off")
    if height > 0:
        task["terrain"][0]["height"] = height
    else:
        task["terrain"][0]["height"] = -height
    return task, f"{100 * height:+.0f} cm"


def hurdle(rng: random.Random) -> tuple[dict[str, Any], str]:
    """Over a hurdle."""
    task, height = shipped("tasks", "hurdle"), round(rng.uniform(0.05, 0.2), 3)
    task["obstacles"][0]["height"] = height
    return task, f"{100 * height:.0f} cm"


def stride(rng: random.Random) -> tuple[dict[str, Any], str]:
    """A stride of a bound."""
    task = shipped("tasks", "bound")
    task["distance"] = round(rng.uniform(0.3, 0.9), 3)
    task["duration"] = round(rng.uniform(0.3, 0.5), 3)
    return task, f"{task['distance']:.2f} m in {task['duration']:.2f} s"


def chain(rng: random.Random) -> tuple[dict[str, Any], str]:
    """Two jumps in a row, each as far ahead."""
    task, ahead = shipped("tasks", "double_jump"), round(rng.uniform(0.1, 0.3), 3)
    task["sequence"][0]["set"] |= {"distance": f"{ahead} m"}
    return task, f"2 x {ahead:.2f} m"


def slope(rng: random.Random) -> tuple[dict[str, Any], str]:
    """A jump on a slope."""
    task, slope = shipped("tasks", "jump"), round(rng.uniform(-10.0, 10.0), 1)
    task["terrain"] = [{"slope": f"{slope} deg"}]
    for moment in ("start", "end"):
        task[moment]["*/foot/gap"] = task[moment].pop("*/foot/z")
        task[moment]["body/pitch"] = f"{slope} deg"
    return task, f"{slope:+.0f} deg"


KINDS = {"platform": platform, "hurdle": hurdle, "stride": stride, "chain": chain, "slope": slope}


def drawn(kind: str, seed: int, number: int, folder: Path) -> tuple[Path, str]:
    """A task's file in `folder`, and what it asks."""
    rng = random.Random(f"{kind} {seed} {number}")
    task, words = KINDS[kind](rng)
    task["supply"] = f"{rng.uniform(0.62, 0.78):.3f} MPa"
    task["payload"] = f"{rng.uniform(0.0, 0.5):.2f} kg"
    longer = rng.uniform(0.9, 1.1)
    robot = shipped("robots", "kemba")
    for part, key in (("femur", "length"), ("tibia", "length"), ("piston", "retracted")):
        length = float(robot["leg"][part][key].removesuffix(" m"))
        robot["leg"][part][key] = f"{longer * length:.4f} m"
    dump_yaml(robot, folder / "robot.yaml")
    dump_yaml({"base": task.get("model", "planning"), "robot": "robot.yaml"}, folder / "own.yaml")
    file = folder / f"{kind}.yaml"
    dump_yaml(task | {"model": "own.yaml"}, file)
    figures = f"{task['supply']}, {task['payload']}, legs x {longer:.2f}"
    return file, f"{words}; {figures}"


def page(rows: list[dict[str, Any]]) -> list[str]:
    """The table, a line for each kind."""
    lines = ["| kind | drawn | refused | a plan on nodes | refined | its replay keeps to it | good "
             "| CPU s, median |", "|---|---:|---:|---:|---:|---:|---:|---:|"]  # fmt: skip
    for kind in KINDS:
        own = [row for row in rows if row["kind"] == kind]
        told = [f"{sum(bool(row.get(key)) for row in own)}"
                for key in ("refused", "planned", "refined", "replay", "good")]  # fmt: skip
        seconds = sorted(row["cpu"] for row in own)
        middle = f"{seconds[len(seconds) // 2]:.0f}" if seconds else ""
        lines.append(f"| {' | '.join([kind, str(len(own)), *told, middle])} |")
    return [*lines, ""]


def main() -> None:
    """Plan what was not planned yet; print or save the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=0, help="of each kind")
    parser.add_argument("--seed", type=int, default=63)
    parser.add_argument("--limit", type=float, default=300.0, help="s of wall clock of a task")
    parser.add_argument("--save", type=Path, help="page whose table is replaced")
    asked = parser.parse_args()
    record = Record(RECORD)
    have = record.known("kind", "seed", "number")
    for number in range(asked.count):
        for kind in (kind for kind in KINDS if (kind, asked.seed, number) not in have):
            with tempfile.TemporaryDirectory() as folder:
                file, words = drawn(kind, asked.seed, number, Path(folder))
                found = answered(file, asked.limit)
            asks = {"kind": kind, "seed": asked.seed, "number": number, "asks": words}
            record.add({**asks, "limit": asked.limit, **found})
    record.show(page(record.rows), asked.save, BEGIN, END)


if __name__ == "__main__":
    main()
