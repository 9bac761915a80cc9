"""Running a blind study: cases in a fair order, resumed from a file, reported into the docs."""

import argparse
import json
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from blind import other_methods, report
from blind.kinds import kind_of
from kemba.identify.answer import Answer
from kemba.identify.discover import discover
from kemba.identify.logs.gate import BadData
from kemba.identify.problem.problem import Problem

Setting = dict[str, Any]
Prepared = tuple[list[dict[str, Any]], Callable[[], Problem]]  # what is hidden, and the problem
Prepare = Callable[[Setting], Prepared]
Draw = Callable[..., Sequence[Setting]]  # all cases, of the usual seed or of another
TIME_LIMIT = 300.0  # s, that of the command
DOCS = Path(__file__).resolve().parents[2] / "benchmarks" / "pages" / "blind-tests.md"


# noise of the sensors: white, or AR(1) with so much left after 1 ms, with wider steps, or drifting
COLOURS: tuple[Setting, ...] = (
    {},
    {"keep": 0.9},
    {},
    {"keep": 0.7, "drift": 1.0},
    {},
    {"keep": 0.95},
    {},
    {"keep": 0.5, "steps": 3.0},
)


def colour(index: int) -> Setting:
    """How the noise of a case's sensors is coloured: every second case has white noise."""
    return COLOURS[index % len(COLOURS)]


def spread(
    repeats: Sequence[tuple[Sequence[Any], int]], rng: np.random.Generator
) -> list[tuple[Any, int]]:
    """(effect, turn) of all cases, each kind evenly over the whole order, so that the beginning
    of a study is a fair sample of it."""
    placed = []
    for kinds, count in repeats:
        for effect in kinds:
            start, turn = rng.random(), int(rng.integers(6))
            places = (np.arange(count) + start) / count
            placed += [(p, effect, turn + i) for i, p in enumerate(places)]
    placed.sort(key=lambda item: item[0])
    return [(effect, turn) for _, effect, turn in placed]


def run(setting: Setting, prepare: Prepare) -> report.Record:
    """One case: what is hidden, what `discover` and other methods say, CPU seconds of the former.

    Whatever goes wrong counts as a miss: a study goes on.
    """
    truth, make = prepare(setting)
    others: dict[str, Any] = {}
    started = time.process_time()
    try:
        problem = make()
        answer = discover(problem, time_limit=TIME_LIMIT).answer
        seconds = time.process_time() - started
        others = other_methods.all_of(problem)
    except Exception as error:
        if not isinstance(error, BadData):
            traceback.print_exc()
        answer, seconds = Answer("bad-data", sentence=str(error)), time.process_time() - started
    told = {"answer": answer.json(), "seconds": seconds, "others": others}
    return {"case": setting, "truth": truth, **told}


def compared(records: list[report.Record], prepare: Prepare, out: Path) -> None:
    """Other methods asked where the file has no answers of all of them; the file is kept up."""
    for record in records:
        known = record.get("others", {})
        if "left_out" in record or record["answer"]["verdict"] == "bad-data":
            continue
        if all(name in known for name in other_methods.METHODS):
            continue
        _, make = prepare(record["case"])
        record["others"] = other_methods.all_of(make())
        report.rewrite(out, records)
        print(f"{record['case']['effect']}: {record['others']}", flush=True)


def main(name: str, text: str | None, draw: Draw, prepare: Prepare) -> None:
    """The command line of a study: run what is not yet in the file, then print the report."""
    parser = argparse.ArgumentParser(description=text)
    parser.add_argument("--cases", type=int, default=None, help="so many of the beginning only")
    parser.add_argument("--seed", type=int, help="other cases, in a file and a table of their own")
    parser.add_argument("--only", default="", help="of these kinds only, as in the report")
    parser.add_argument("--out", type=Path, default=Path(f"{name}.jsonl"))
    parser.add_argument("--part", default="1/1", help="i/n: every n-th case, from the i-th on")
    parser.add_argument("--write", action="store_true", help="put the report into the docs")
    parser.add_argument("--report", action="store_true", help="run nothing, only report the file")
    parser.add_argument(
        "--others", action="store_true", help="ask only other methods, about what is in the file"
    )
    options = parser.parse_args()
    cases = draw() if options.seed is None else draw(options.seed)
    if options.others:
        compared(report.read(options.out), prepare, options.out)
    for setting in () if options.report or options.others else _pending(cases, options):
        try:
            record = run(setting, prepare)
        except RuntimeError as error:  # the twin cannot do this case, as when every motion topples
            report.append(options.out, {"case": setting, "left_out": str(error)})
            print(f"left out: {setting['effect']} {setting['seed']}: {error}", flush=True)
            continue
        report.append(options.out, record)
        print(report.line(record), flush=True)
    records = report.read(options.out)
    done = [record for record in records if "left_out" not in record]
    found = f"{len(done)} of {len(cases)} cases run, {len(records) - len(done)} left out because "
    found += f"the twin cannot do them.\n\n{report.table(done)}"
    print(found)
    if options.write:
        report.write(DOCS, name if options.seed is None else f"{name} {options.seed}", found)


def _pending(cases: Sequence[Setting], options: argparse.Namespace) -> Iterator[Setting]:
    """What this part has to do and the file does not have."""
    done = {json.dumps(r["case"], sort_keys=True) for r in report.read(options.out)}
    part, parts = (int(p) for p in options.part.split("/"))
    kinds = options.only.split(",")
    wanted = [c for c in cases if not options.only or kind_of(c["effect"]) in kinds]
    for setting in wanted[: options.cases][part - 1 :: parts]:
        if json.dumps(setting, sort_keys=True) not in done:
            yield setting
