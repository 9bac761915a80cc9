"""Plans added to the shelf: python benchmarks/more_plans.py WALK... [--jobs N] [--folder DIR].

Does the named walks of `configs/plans/walks.yaml`, of which some may begin from shipped plans, and
adds what they found to `configs/plans` and `docs/shipped-plans.md`: plans that are good, whose
table is exact, and of whose figures there is no plan that costs as little. All other plans stay.
"""

from __future__ import annotations

import argparse
import csv
import json
import re
import shutil
from pathlib import Path
from typing import Any

from shipped_plans import PAGE, best, facts_of, index_row, page_line, walked, write_index

from kemba.config import shipped_folder
from kemba.ocp.shipped.kind import FIGURES
from kemba.ocp.shipped.shelf import INDEX

Row = tuple[list[str], str]  # the line of the index, the line of the page


def shelf_rows() -> list[Row]:
    """What is on the shelf: index and page have the same order."""
    with (shipped_folder("plans") / INDEX).open(encoding="utf-8", newline="") as stream:
        index = list(csv.reader(stream))[1:]
    lines = [x for x in PAGE.read_text(encoding="utf-8").splitlines() if x.startswith("| ")][1:]
    return list(zip(index, lines, strict=True))


def sorted_by(row: Row) -> tuple[str, list[float], float]:
    """Task, figures, cost: the order of the shelf."""
    index, line = row
    figures = index[2 : 2 + len(FIGURES)]
    return _cells(line)[0], [float(f or 0.0) for f in figures], float(index[-3])


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip("|").split("|")]


def given(rows: list[Row], folder: Path) -> None:
    """The shelf's plans in `folder`, with the facts that a walk needs of its first plan."""
    folder.mkdir(parents=True, exist_ok=True)
    for index, line in rows:
        air = _cells(line)[1 + len(FIGURES)]
        facts = {
            "task": _cells(line)[0],
            "set": [f"landing.air={air}"] * bool(air),
            "figures": {k: float(v) for k, v in zip(FIGURES, index[2:], strict=False) if v},
        }
        shutil.copy(shipped_folder("plans") / index[0], folder / index[0])
        (folder / index[0]).with_suffix(".json").write_text(json.dumps(facts), encoding="utf-8")


def new_plans(rows: list[Row], folder: Path) -> list[dict[str, Any]]:
    """Plans that the walks left in `folder` and that belong on the shelf."""
    old = {index[0].removesuffix(".npz") for index, _ in rows}
    found = [facts_of(p) for p in sorted(folder.glob("*.json")) if p.stem not in old]
    same = {tuple(index[1 : 2 + len(FIGURES)]): float(index[-3]) for index, _ in rows[::-1]}
    return [f for f in best(found) if f["cost"] < same.get(tuple(index_row(f)[1:-3]), float("inf"))]


def shelved(rows: list[Row], new: list[dict[str, Any]]) -> None:
    """Index and page written with the new plans, whose files are copied to the shelf."""
    for facts in new:
        shutil.copy(facts["path"].with_suffix(".npz"), shipped_folder("plans"))
    rows = sorted([*rows, *((index_row(f), page_line(f)) for f in new)], key=sorted_by)
    write_index(shipped_folder("plans") / INDEX, (index for index, _ in rows))
    text = PAGE.read_text(encoding="utf-8")
    text = re.sub(r"Of (\d+) plans", lambda m: f"Of {int(m[1]) + len(new)} plans", text)
    title, *_ = (line for line in text.splitlines() if line.startswith("| "))
    around = [line for line in text.splitlines() if not line.startswith("| ")]
    around.insert(len(around) - 1, title)  # the last line is the rule below the title
    PAGE.write_text("\n".join([*around, *(line for _, line in rows)]) + "\n", encoding="utf-8")


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("walks", nargs="+", metavar="WALK")
    parser.add_argument("--jobs", type=int, help="workers; by default the cores")
    parser.add_argument("--folder", type=Path, default=Path("runs/more-plans"), help="results")
    asked = parser.parse_args()
    rows, plans = shelf_rows(), asked.folder / "plans"
    given(rows, plans)
    walked(asked.jobs, asked.folder, asked.walks)
    new = new_plans(rows, plans)
    shelved(rows, new)
    print("\n".join(f"added: {f['path'].stem}, {f['cost']:.3g}" for f in new) or "nothing added")


if __name__ == "__main__":
    main()
