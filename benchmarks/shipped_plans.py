"""The shipped plans made anew: python benchmarks/shipped_plans.py [--jobs N] [--choose].

Walks of `configs/plans/walks.yaml` are done on a local Dask cluster, those of one round side by
side; a walk that is done is not repeated. Of all plans of the same figures whose executions keep to
the task's tolerances one or two are kept (`own_of`). Writes `configs/plans/*.npz` and `plans.csv`,
and the page `docs/shipped-plans.md`.
"""

from __future__ import annotations

import argparse
import csv
import json
import platform
import shutil
from collections import defaultdict
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from kemba.config import load_yaml, shipped_folder
from kemba.ocp import load_task, task_model
from kemba.ocp.shipped.entry import kept_fit, read_plan
from kemba.ocp.shipped.kind import FIGURES, kind_of
from kemba.ocp.shipped.shelf import INDEX
from kemba.report.walks import SCENARIOS
from kemba.sweep.cases.case import Case
from kemba.sweep.workers.farm import run_cases

UNITS = {"height": "m", "distance": "m", "supply": "Pa", "payload": "kg", "duration": "s"}
TABLE = 1e-3  # m, of apex by which an execution of the table may miss the plan
DEAR = 1.5  # times the cost: what is asked of robust plans
CLEAR = 3  # landings of SCENARIOS: 5 %, fewer more may be chance
SURE = 59  # usual landings of SCENARIOS: 98 % or more are asked of plans
PAGE = Path(__file__).parents[1] / "docs" / "shipped-plans.md"
HEAD = """\
# Shipped plans

`kemba-opt solve` begins from these plans where its task differs from one of them only by the
figures of this table, and only a little (`kemba/ocp/shipped/shelf.py` says how much). See
[solving](continuing.md#from-a-shipped-plan). They were continued from plans that were found from a
guess, each with its solved program. Of {tried} plans those count whose executions keep to the
task's tolerances, also on the full plant, and whose table gives the planned apex within 1 mm (where
that was noted). Of the same figures the one was kept with the smallest cost per landing, in 60
scenarios at twice the usual uncertainty (the last column), or a cheaper one that lands in {sure} of
60 usual scenarios or more. Beside it there is the one that lands most often, where that is {clear}
of 60 more at least and it costs at most {dear:g} times as much: from that `--robust` begins. `of`:
among how many. Errors are those on the plant. `air`: the [`landing.air`](tasks.md) with which a
plan was made, a pulse on stretched legs. `fitted`: made with
[air that fits the plant](continuing.md#air-that-fits-the-plant); a task that begins from it has the
same air. [Height by height](plan-quality.md#height-by-height) says what `solve` finds.
Facts of earlier plans were read again from their files when the page was written anew, so that `of`
is too low there; their programs were solved again on their own nodes, from the nodes.
Written by `benchmarks/shipped_plans.py` on {machine}.

"""


def walked(jobs: int | None, folder: Path, names: Sequence[str] = ()) -> None:
    """Every walk that is not done yet, or those of these `names`, round by round."""
    for walks in load_yaml(shipped_folder("plans") / "walks.yaml").data["rounds"]:
        cases = [_case(w, folder) for w in walks if not names or w["name"] in names]
        run_cases(cases, folder, jobs=jobs, tell=lambda case, record: print(
            case.values["name"], record["sentence"], f"{record['cpu_s']:.0f} s", flush=True
        ))  # fmt: skip


def choose(folder: Path) -> None:
    """The best plans to the shelf, its index and its page."""
    shelf = shipped_folder("plans")
    found = [facts_of(path) for path in sorted((folder / "plans").glob("*.json"))]
    chosen = best(found)
    for old in shelf.glob("*.npz"):
        old.unlink()
    for row in chosen:
        shutil.copy(row["path"].with_suffix(".npz"), shelf / f"{row['path'].stem}.npz")
    write_index(shelf / INDEX, map(index_row, chosen))
    PAGE.write_text(page(chosen, len(found)), encoding="utf-8")


def _case(walk: dict[str, Any], folder: Path) -> Case:
    work = {"set": [], "first": "", **walk, "folder": str(folder / "plans")}
    return Case("walks", 0, {"name": walk["name"]}, "kemba.report.walks:walk", work)


def facts_of(path: Path) -> dict[str, Any]:
    """What a walk noted about a plan, with the kind of its task as that is today."""
    facts = json.loads(path.read_text(encoding="utf-8"))
    fitted = kept_fit(read_plan(path.with_suffix(".npz"))) is not None
    kind = _kind(facts["task"], tuple(facts["set"]))
    return {**facts, "path": path, "kind": kind, "fitted": fitted}


@cache
def _kind(name: str, overrides: tuple[str, ...]) -> str:
    task, document = load_task(name, list(overrides))
    return kind_of(task, task_model(task, document=document))


def best(found: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The plans to keep of each kind and figures, with `of`: among how many."""
    same = defaultdict(list)
    for facts in found:
        figures = tuple(sorted((k, round(v, 6)) for k, v in facts["figures"].items()))
        same[facts["kind"], figures].append(facts)
    chosen = []
    for plans in same.values():
        good = [facts for facts in plans if facts["good"] and _exact(facts)]
        if good:
            chosen += [{**own, "of": len(plans)} for own in own_of(good)]
    return sorted(chosen, key=lambda c: (c["task"], *(c["figures"].get(k, 0.0) for k in FIGURES)))


def _exact(facts: dict[str, Any]) -> bool:
    """Whether its table gives the planned apex on the plan's model, as far as that was noted."""
    return abs(facts.get("table", {}).get("apex_error_m", 0.0)) <= TABLE


def own_of(good: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The plan with the smallest cost per landing at twice the usual uncertainty, or a cheaper one
    that lands surely at the usual one; and beside it the one that lands most often, where that is
    clear and not dear."""
    lands = min(good, key=lambda facts: facts["cost"] / max(facts["landed"], 1))
    sure = (facts for facts in good if facts.get("usual", 0) >= SURE)
    own = min([lands, *sure], key=lambda facts: facts["cost"])
    beside = [facts for facts in good if facts["cost"] <= DEAR * own["cost"]]
    most = max(beside, key=lambda facts: (facts["landed"], -facts["cost"]))
    return [own, most] if most["landed"] >= own["landed"] + CLEAR else [own]


def write_index(path: Path, rows: Iterable[Sequence[str]]) -> None:
    """The table that `kemba.ocp.shipped.shelf` reads."""
    with path.open("w", encoding="utf-8", newline="") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(["file", "kind", *FIGURES, "cost", "of", "landed"])
        table.writerows(rows)


def index_row(row: dict[str, Any]) -> list[str]:
    """The line of the index about a plan."""
    figures = [f"{row['figures'][k]:.9g}" if k in row["figures"] else "" for k in FIGURES]
    facts = f"{row['cost']:.6g}", str(row["of"]), str(row["landed"])
    return [f"{row['path'].stem}.npz", row["kind"], *figures, *facts]


def page(chosen: list[dict[str, Any]], tried: int) -> str:
    """The page for people."""
    text = HEAD.format(
        tried=tried,
        sure=SURE,
        clear=CLEAR,
        dear=DEAR,
        machine=platform.processor() or platform.machine(),
    )
    columns = ["task", *(f"{k} [{UNITS[k]}]" for k in FIGURES)]
    columns += ["air", "fitted", "torque² [N².m².s]", "valves [s]", "cost", "of"]
    columns += ["apex [mm]", "touchdown [ms]", "end [mm]", f"lands, of {SCENARIOS}"]
    lines = ["| " + " | ".join(columns) + " |", "|---" * len(columns) + "|"]
    return text + "\n".join([*lines, *map(page_line, chosen)]) + "\n"


def page_line(row: dict[str, Any]) -> str:
    """The line of the page about a plan."""
    figures = [f"{row['figures'][k]:g}" if k in row["figures"] else "" for k in FIGURES]
    plant = row["plant"]
    late = plant["touchdown_error_s"]
    errors = [f"{1e3 * plant['apex_error_m']:+.1f}", f"{1e3 * plant['final_error_m']:.1f}"]
    errors.insert(1, "" if late is None else f"{1e3 * late:+.1f}")
    air = [word.split("=")[1] for word in row["set"] if word.startswith("landing.air=")]
    cost = ["".join(air), "yes" if row["fitted"] else ""]
    cost += [f"{row['torque_squared_integral']:.3g}", f"{row['valve_open_s']:.2f}"]
    cells = [row["task"], *figures, *cost, f"{row['cost']:.3g}", str(row["of"]), *errors]
    return "| " + " | ".join([*cells, str(row["landed"])]) + " |"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--jobs", type=int, help="workers; by default the cores")
    parser.add_argument(
        "--folder", type=Path, default=Path("runs/shipped-plans"), help="kept results"
    )
    parser.add_argument("--choose", action="store_true", help="walk no further")
    words = parser.parse_args()
    if not words.choose:
        walked(words.jobs, words.folder)
    choose(words.folder)
