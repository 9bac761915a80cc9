# ruff: noqa: E402  (the twins are found first)
"""What the logs themselves say of the single effects that `discover` missed.

    python benchmarks/blind/misses.py --write

At the end of the search, each of them is fitted to its logs, and so is what was answered instead:
nominal figures within their tolerances, and small shares of all other effects, as every machine
has them. The gain is how much better the hidden effect explains these and the readings: half the
fall of the sum of squares [nats]. Where nothing is hidden, the best of so many effects gains more
than the last column in about 3 % of all logs (chi-squared, Bonferroni; in fewer, as effects act
alike).
"""

from __future__ import annotations

import argparse
import importlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]

import numpy as np
from block import printed
from scipy.stats import chi2

from blind import report, study
from blind.kinds import hidden, kind, named
from kemba.identify.discover import discover
from kemba.identify.evidence.search import Search
from kemba.identify.evidence.spike_slab import Hypothesis

STUDIES = ("bench", "robot", "second")
FALSE = 0.03  # share of machines without any effect that may be blamed


def missed(name: str) -> Iterator[report.Record]:
    """Records of one hidden effect that is not the first of an answer that names any."""
    for record in report.read(Path(__file__).with_name(f"{name}.jsonl")):
        if kind(record) in ("single", "sensor", "shape") and not report.among_first(record, 1):
            yield record


def gain(search: Search, effect: str, answered: Hypothesis) -> float:
    """How much better an effect explains the logs than the answer does [nats]."""
    for hypothesis in (answered, (effect,)):
        search.visit(hypothesis)
    search.refresh()
    return misfit(search, answered) - misfit(search, (effect,))


def misfit(search: Search, hypothesis: Hypothesis) -> float:
    """Half the sum of squares at the best fit: of readings, nominal figures and small effects, in
    sigmas of their noise and of their priors [nats]."""
    linear = search.points[hypothesis].mode.linear
    weight = search.base.ranker(linear).widths(hypothesis, 1.0) ** -2.0
    gram, slope, power = linear.total
    off = linear.mean - linear.at
    pull = weight * off - slope
    step = np.linalg.solve(gram + np.diag(weight), pull)
    return 0.5 * float(power + weight @ off**2 - pull @ step)


def told(name: str, record: report.Record) -> str:
    """One line of the table."""
    _, make = importlib.import_module(f"blind.{name}").prepared(record["case"])
    search = discover(make(), time_limit=study.TIME_LIMIT).search
    effect, answered = hidden(record)[0], tuple(sorted(named(record)))
    size = next(iter(record["truth"][0]["parameters"].values()))
    says = " + ".join(answered) or record["answer"]["verdict"]
    chance = 0.5 * float(chi2.isf(FALSE / len(search.problem.candidates), 1))
    gained = gain(search, effect, answered)
    return f"| {name} | {effect} | {size:.3g} | {says} | {gained:.1f} | {chance:.1f} |"


def table(cases: int | None) -> Iterator[str]:
    """Lines of the table, of so many misses of each study (None: all)."""
    yield "| logs of | hidden | size [SI] | answered | gain of it [nats] | 3 % by chance [nats] |"
    yield "|---|---|---:|---|---:|---:|"
    for name in STUDIES:
        for record in list(missed(name))[:cases]:
            yield told(name, record)


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, help="so many misses of each study only")
    parser.add_argument("--write", action="store_true", help="put the table into the docs")
    asked = parser.parse_args()
    lines = printed(table(asked.cases))
    if asked.write:
        report.write(study.DOCS, "misses", "\n".join(lines))


if __name__ == "__main__":
    main()
