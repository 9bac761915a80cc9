# ruff: noqa: E402  (the twins are found first)
"""A search for formulas (adcd) on the force that the bench's model misses, beside `discover`.

    pip install adcd==3.0.0     # brings JAX; not one of kemba's dependencies
    python benchmarks/blind/formula_search.py [--cases 40] [--write]

adcd corrects a law by one term in its variables: here the rod's force, by speed and position. It is
given every run but the last, 400 rows in all, and judged on the last. What kemba says of the same
cases is read from bench.jsonl.
"""

import argparse
import logging
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]

import numpy as np

from blind import bench, report, study
from blind.kinds import hidden, kind
from blind.other_methods import figures_of
from kemba.identify.bench.problem import FORCE, BenchProblem

ROWS = 400  # of all runs but the last, evenly taken
UNITS = {"v": "m/s", "x": "m"}
Run = dict[str, np.ndarray]


def runs_of(problem: BenchProblem) -> list[Run]:
    """Per run: speed, position, measured and expected force, and the 1 sigma of their gap; with
    the nominal figures that fit best."""
    found, figures = [], figures_of(problem)
    for i, log in enumerate(problem.logs):
        expected, variance = problem.readings(figures, i)[FORCE]
        columns = {
            "v": log.motion.v,
            "x": log.motion.x,
            "measured": log.measured[FORCE],
            "expected": expected,
            "sigma": np.sqrt(variance),
        }
        found.append({name: column[log.keep[FORCE]] for name, column in columns.items()})
    return found


def corrected(runs: list[Run]) -> tuple[str, float, float]:
    """The term that adcd adds, and the error of the last run without and with it [noise]."""
    import adcd
    import sympy

    logging.disable(logging.WARNING)
    joined = {name: np.concatenate([run[name] for run in runs[:-1]]) for name in runs[0]}
    some = np.linspace(0, len(joined["v"]) - 1, ROWS).astype(int)
    given = {name: joined[name][some] for name in UNITS}
    forces = joined["measured"][some], joined["expected"][some]
    answer = adcd.fit(given, *forces, limit_variable="v", variables_with_units=UNITS,
                      correction_mode="additive", verbose=False)  # fmt: skip
    last, term = runs[-1], sympy.sympify(answer.best_expr)
    added = sympy.lambdify(list(UNITS), term.subs(answer.best_theta))(*(last[n] for n in UNITS))
    gap = last["measured"] - last["expected"]
    before, after = (float(np.sqrt(np.mean((g / last["sigma"]) ** 2))) for g in (gap, gap - added))
    return str(term), before, after


def rows(records: list[report.Record]) -> Iterator[dict[str, Any]]:
    """What both say of each case."""
    for record in records:
        _, make = bench.prepared(record["case"])
        problem = make()
        assert isinstance(problem, BenchProblem)
        term, before, after = corrected(runs_of(problem))
        answer = record["answer"]
        yield {
            "hidden": hidden(record),
            "term": term,
            "adcd": (before, after),
            "kemba": (answer["error_before"], answer["error_after"]),
            "named": bool(answer["added"]),
        }


def table(found: list[dict[str, Any]]) -> Iterator[str]:
    """The lines of the page."""
    yield "| method | nothing hidden: a term all the same | one hidden: error, median [noise] |"
    yield "|---|---|---|"
    nulls = [row for row in found if not row["hidden"]]
    one = [row for row in found if row["hidden"]]
    for name, claims in (("kemba", sum(row["named"] for row in nulls)), ("adcd", len(nulls))):
        before, after = np.median([row[name] for row in one], axis=0)
        yield f"| {name} | {claims} of {len(nulls)} | {before:.2f}, then {after:.2f} |"


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=40, help="of the record's beginning")
    parser.add_argument("--record", type=Path, default=Path(__file__).with_name("bench.jsonl"))
    parser.add_argument("--write", action="store_true", help="put the table into the docs")
    asked = parser.parse_args()
    known = [r for r in report.read(asked.record) if kind(r) in ("single", "null")]
    found = []
    for row in rows(known[: asked.cases]):
        print(row, flush=True)
        found.append(row)
    lines = "\n".join(table(found))
    print(lines)
    if asked.write:
        report.write(study.DOCS, "formulas", lines)


if __name__ == "__main__":
    main()
