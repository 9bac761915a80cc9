"""The table of benchmarks/quality.py from its record."""

import json
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from block import put_block

from kemba.sweep import machine

RECORD = Path(__file__).with_name("quality.jsonl")
REFINED = 3  # of the cheapest starts of each task
BEGIN = "<!-- quality: written by benchmarks/quality.py -->"
END = "<!-- end of quality -->"


def compared() -> list[dict[str, Any]]:
    """One row a task: the default's cost beside the best of its random starts."""
    tasks: dict[str, dict[str, list[dict[str, Any]]]] = defaultdict(lambda: defaultdict(list))
    for line in RECORD.read_text(encoding="utf-8").splitlines():
        row = json.loads(line)
        tasks[row["task"]][row["kind"]].append(row)
    found = []
    for name, kinds in tasks.items():
        if not kinds["default"] or not kinds["start"]:
            continue
        own = kinds["default"][-1]
        best = min((r["cost"] for r in kinds["refined"] if r["cost"]), default=None)
        kept = min((r["cost"] for r in kinds["refined"] if r["cost"] and r["good"]), default=None)
        found.append({
            "task": name, "starts": len(kinds["start"]), "own": own["cost"], "good": own["good"],
            "from": own["start"], "best": best, "kept": kept, "cpu_s": own["cpu_s"],
            "solved": sum(r["cost"] is not None for r in kinds["start"]),
        })  # fmt: skip
    return found


def ratio(row: dict[str, Any], key: str) -> float:
    """The default's cost over the best one; infinite where only a random start has a plan, not a
    number where none has."""
    if row[key] is None:
        return np.nan
    return float(row["own"] / row[key]) if row["own"] else np.inf


def summary() -> list[str]:
    """The lines of the page."""
    rows = compared()
    lines = [
        "| task | starts (with a plan) | begun from | good | cost | best of the starts | ratio |",
        "|---|---:|---|---|---:|---:|---:|",
    ]
    for row in sorted(rows, key=lambda r: -np.nan_to_num(ratio(r, "best"), nan=-1.0)):
        cost, best = (f"{row[k]:.3g}" if row[k] else "none" for k in ("own", "best"))
        over = f"{ratio(row, 'best'):.2f}" if row["own"] and row["best"] else ""
        cells = (
            row["task"].replace(".yaml", ""), f"{row['starts']} ({row['solved']})",
            row["from"].removeprefix("shipped: "), "yes" if row["good"] else "no", cost, best, over,
        )  # fmt: skip
        lines.append(f"| {' | '.join(cells)} |")
    return [*_told(rows), "", *lines, "", f"On {machine()}."]


def _told(rows: list[dict[str, Any]]) -> list[str]:
    said = []
    for key, what in (("best", "random starts"), ("kept", "random starts that the plant keeps to")):
        known = np.array([ratio(r, key) for r in rows])
        known = known[np.isfinite(known) | np.isinf(known)]
        if not len(known):
            continue
        said.append(
            f"Against {what}: within 1.10 in {np.sum(known <= 1.1)} of {len(known)} tasks, within "
            f"1.5 in {np.sum(known <= 1.5)}, at most {known.max():.3g} times."
        )
    every = [json.loads(line) for line in RECORD.read_text(encoding="utf-8").splitlines()]
    own = [row for row in every if row["kind"] == "default"]
    good, cpu = sum(row["good"] for row in own), np.median([row["cpu_s"] for row in own])
    none = sum(row["cost"] is None for row in own)
    said.append(
        f"Of {len(own)} defaults {good} are good, also on the plant, and {none} have no refined "
        f"plan; {cpu:.1f} CPU s in the median."
    )
    return said


def written(page: Path) -> None:
    """Put the table into the page."""
    put_block(page, BEGIN, END, summary())
