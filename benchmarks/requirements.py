"""Is every requirement of a task kept, or its miss told? Random ones, checked on the written CSV.

    python benchmarks/requirements.py --draws 125 --each 4 --seed 3 --out requirements.json

Each draw takes one of eight tasks (the six shipped ones, a platform-like crouch and a hop with a
turn), plans it plainly, and adds `--each` requirements at random: a quantity, a moment or an
interval, a value near that of the plain plan or well away from it. The answer of `solve` is then
compared with the columns of trajectory.csv, read by nothing but the csv module. A requirement is
silent where the answer is `solved`, but the file does not keep it.
"""

import argparse
import csv
import json
import random
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

from kemba.config import Document, load_text
from kemba.errors import KembaError
from kemba.ocp import load_task
from kemba.ocp.task.task import parse_task
from kemba.report.solving import solve_into
from kemba.runs import RunFolder
from kemba.scenarios.share import wilson
from kemba.solve import Approach, Listener

TASKS = ("jump", "hop", "stand", "drop", "jump_forward", "max_jump", "crouch", "turn")
OWN = {
    "crouch": ("stand", {"height": 0.24, "duration": 0.8, "name": "crouch"}),
    "turn": ("hop", {"height": 0.36, "name": "turn"}),
}
QUANTITIES = (
    "body/x", "body/z", "body/pitch", "body/vx", "body/vz", "front/piston/x", "rear/piston/x",
    "front/foot/z", "rear/foot/z", "front/foot/x", "front/knee/z", "rear/hip/z", "front/hip/q",
    "rear/hip/w", "front/hip/tau", "rear/valve/extend", "front/valve/retract",
)  # fmt: skip
SIZES = {"m": 0.02, "rad": 0.1, "m.s-1": 0.3, "rad.s-1": 1.0, "N.m": 2.0, "1": 1.0}
TOLERANCE = 2e-6  # of `SIZES`' scale; what the task itself allows, and rounding of the file


def base(name: str) -> Document:
    shipped, changes = OWN.get(name, (name, {}))
    document = load_task(f"{shipped}.yaml")[1]
    return Document({**document.data, **changes, "name": name}, document.source)


def rows_of(run: Path) -> tuple[dict[str, list[float]], dict[str, str]]:
    """Columns and units of trajectory.csv."""
    with (run / "trajectory.csv").open(newline="", encoding="utf-8") as stream:
        header, *rows = list(csv.reader(stream))
    names = [text.partition(" [")[0] for text in header]
    units = {n: text.partition(" [")[2].rstrip("]") for n, text in zip(names, header, strict=True)}
    columns = {n: [float(row[i] or "nan") for row in rows] for i, n in enumerate(names)}
    return columns, units


def drawn(rng: random.Random, columns: dict[str, list[float]], units: dict[str, str]) -> Any:
    """A requirement: where it stands in the task, and its quantity, moment and limits."""
    name = rng.choice([q for q in QUANTITIES if q in columns])
    size, last = SIZES[units[name]], len(columns[name]) - 1
    acts = "tau" in name or "valve" in name
    way = rng.choice(["end", "bounds", "at", "during"])
    first = rng.uniform(0.05, 0.7)
    shares = {"end": (1.0, 1.0), "bounds": (0.0, 1.0), "at": (first, first),
              "during": (first, first + rng.uniform(0.0, 0.25))}[way]  # fmt: skip
    there = columns[name][max(int(acts), round(shares[0] * last))]
    near = there + size * rng.choice([0.0, 0.0, rng.gauss(0, 0.5), rng.gauss(0, 3.0)])
    if "valve" in name:
        near = float(rng.random() < 0.5)
    kind = rng.choice(["equals", "at_least", "at_most"]) if way in ("end", "at") else rng.choice(
        ["at_least", "at_most"])  # fmt: skip
    if way in ("bounds", "during") and rng.random() < 0.7:
        part = columns[name][max(int(acts), round(shares[0] * last)) : round(shares[1] * last) + 1]
        edge = max(part or [near]) if kind == "at_most" else min(part or [near])
        near = edge + size * rng.gauss(0, 0.3)
    limits = {kind: near}
    return way, name, shares, acts, limits


def with_asked(data: dict[str, Any], asked: list[Any]) -> dict[str, Any]:
    data = json.loads(json.dumps(data))
    for k, (way, name, shares, _, limits) in enumerate(asked):
        if way in ("end", "bounds"):
            data.setdefault(way, {})[name] = limits
        else:
            when = {"at": shares[0]} if way == "at" else {"during": list(shares)}
            data.setdefault("goals", {})[f"drawn{k}"] = {"quantity": name, **when, **limits}
    return data


def misses(asked: list[Any], columns: dict[str, list[float]], units: dict[str, str]) -> list[str]:
    """The drawn requirements that the file does not keep at the nodes."""
    found = []
    for way, name, (begin, end), acts, limits in asked:
        values, last = columns[name], len(columns[name]) - 1
        if way in ("end", "at"):
            nodes = [max(int(acts), round(begin * last))]
        else:
            nodes = [
                n
                for n in range(int(acts), last + 1)
                if begin * last - 1e-9 <= n <= end * last + 1e-9
            ]
        lower = limits.get("equals", limits.get("at_least", float("-inf")))
        upper = limits.get("equals", limits.get("at_most", float("inf")))
        for n in nodes:
            over = max(lower - values[n], values[n] - upper)
            if over > TOLERANCE * max(10.0 * SIZES[units[name]], 1.0):
                found.append(f"{way} {name} {limits} is {values[n]:.6g} at node {n}")
                break
    return found


def solve(data: dict[str, Any], folder: Path) -> dict[str, Any]:
    document = load_text(json.dumps(data), "drawn.yaml")
    task = parse_task(document)
    run = RunFolder.create(folder, task.name, [], force=True)
    return solve_into(run, task, document, Listener(), Approach(replay=False), figure=False)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=125)
    parser.add_argument("--each", type=int, default=4)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--limit", type=float, default=40.0, help="seconds of a solve")
    parser.add_argument("--out", type=Path, default=Path("requirements.json"))
    asked = parser.parse_args()
    rng, counts, silent, scratch = random.Random(asked.seed), Counter(), [], tempfile.mkdtemp()
    plain: dict[str, Any] = {}
    for number in range(asked.draws):
        name = TASKS[number % len(TASKS)]
        data = base(name).data
        data["solver"] = {**data.get("solver", {}), "time_limit": asked.limit}
        folder = Path(scratch) / name
        if name not in plain:
            solve(data, folder)
            plain[name] = rows_of(folder)
        wanted = [drawn(rng, *plain[name]) for _ in range(asked.each)]
        try:
            answer = solve(with_asked(data, wanted), Path(scratch) / f"{name}-{number}")
        except KembaError as error:
            counts["refused before any solve"] += len(wanted)
            print(number, name, "refused:", str(error).splitlines()[0][:160], flush=True)
            continue
        status, missed = str(answer["status"]), []
        file = Path(scratch) / f"{name}-{number}" / "trajectory.csv"
        if file.is_file():
            missed = misses(wanted, *rows_of(file.parent))
        counts[status] += len(wanted)
        if status == "solved":
            counts["solved, kept"] += len(wanted) - len(missed)
            silent += [f"{number} {name}: {text}" for text in missed]
        print(number, name, status, "; ".join(missed)[:200], flush=True)
    total = asked.draws * asked.each
    low, high = wilson(len(silent), total)
    facts = {"requirements": total, "seed": asked.seed, "counts": dict(counts), "silent": silent,
             "wilson": [low, high]}  # fmt: skip
    asked.out.write_text(json.dumps(facts, indent=1), encoding="utf-8")
    print(json.dumps(facts, indent=1))


if __name__ == "__main__":
    main()
