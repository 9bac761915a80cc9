# ruff: noqa: E402  (the twins are found first)
"""What the logs themselves say of the single effects that `discover` missed.

    python benchmarks/blind/misses.py --write

At the end of the search, each of them is fitted to its logs, and so is what was answered instead:
nominal figures within their tolerances, and small shares of all other effects, as every machine
has them. The gain is how much better the hidden effect explains these and the readings: half the
fall of the sum of squares [nats]. Where nothing is hidden, the best of so many effects gains more
than the last column in about 3 % of all logs (chi-squared, Bonferroni; in fewer, as effects act
alike).

Along a robot's motion residuals are linear, and fits are those of the search. On the bench edges of
valves move past readings: there every fit is sought anew, with slopes of each of its steps, also
from the hidden effect as it is, which `discover` cannot know. Logs that were refused are left out.
"""

import argparse
import importlib
import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]

from block import printed
from scipy.stats import chi2

from blind import report, study
from blind.kinds import Record, hidden, kind, named
from blind.thorough import ThoroughFit, promised, with_own
from kemba.identify.discover import discover
from kemba.identify.infer.linear import NULL, Hypothesis
from kemba.identify.infer.refit import Fit
from kemba.identify.infer.search import Search
from kemba.identify.problem.problem import Theta

STUDIES = (
    *("bench", "robot", "second"),
    *("bench_16000", "bench_26000", "bench_31000", "robot_19000", "robot_24000", "second_21000"),
)
FALSE = 0.03  # share of machines without any effect that may be blamed


def missed(name: str) -> Iterator[Record]:
    """Records of one hidden effect that is not the first of an answer that names any."""
    for record in report.read(Path(__file__).with_name(f"{name}.jsonl")):
        refused = record["answer"]["verdict"] == "bad-data"
        one = kind(record) in ("single", "sensor", "shape")
        if one and not refused and not report.among_first(record, 1):
            yield record


def gain(search: Search, record: Record) -> float:
    """How much better the hidden effect explains the logs than the answer does [nats]."""
    answered, true = tuple(sorted(named(record))), (hidden(record)[0],)
    for hypothesis in (answered, true):
        search.visit(hypothesis)
    if search.problem.moves:
        return misfit(search, answered) - misfit(search, true)
    starts = [search.points[h].mode.theta for h in (NULL, answered, true)]
    starts.append(true_machine(search, record))
    for hypothesis in (answered, true):  # each begins where the other ended as well
        starts.append(searched(search, hypothesis, starts).theta)
    ends = [searched(search, hypothesis, starts[-2:]) for hypothesis in (answered, true)]
    return ends[0].cost - ends[1].cost


def true_machine(search: Search, record: Record) -> dict[str, float]:
    """Theta of the hidden effect as it is, on a machine that is as its file says."""
    (effect,) = record["truth"]
    nominal = {name: mean for name, (mean, _) in search.problem.nuisance.items()}
    return nominal | {f"{effect['kind']}.{k}": v for k, v in effect["parameters"].items()}


def searched(search: Search, hypothesis: Hypothesis, starts: Sequence[Theta]) -> Fit:
    """The best fit from these starts, without and with what the search found of the effects."""
    point = search.points[hypothesis]
    beside = [with_own(search.problem, s, hypothesis, point.mode.theta) for s in starts]
    begun = [*starts, *(beside if hypothesis else ())]
    fit = ThoroughFit(search.problem, hypothesis, point.linear)
    return min((fit.found(start) for start in begun), key=lambda end: end.cost)


def misfit(search: Search, hypothesis: Hypothesis) -> float:
    """Half the sum of squares at the best fit: of readings, nominal figures and small effects, in
    sigmas of their noise and of their priors [nats]."""
    point = search.points[hypothesis]
    return point.mode.cost - promised(search.base, point)


def told(name: str, record: report.Record) -> str:
    """One line of the table."""
    _, make = importlib.import_module(f"blind.{name.split('_')[0]}").prepared(record["case"])
    search = discover(make(), time_limit=study.TIME_LIMIT).search
    effect, answered = hidden(record)[0], tuple(sorted(named(record)))
    size = next(iter(record["truth"][0]["parameters"].values()))
    says = " + ".join(answered) or record["answer"]["verdict"]
    chance = 0.5 * float(chi2.isf(FALSE / len(search.problem.candidates), 1))
    gained = gain(search, record)
    return f"| {name} | {effect} | {size:.3g} | {says} | {gained:.1f} | {chance:.1f} |"


def table(studies: Sequence[str], cases: int | None) -> Iterator[str]:
    """Lines of the table, of so many misses of each study (None: all)."""
    yield "| logs of | hidden | size [SI] | answered | gain of it [nats] | 3 % by chance [nats] |"
    yield "|---|---|---:|---|---:|---:|"
    for name in studies:
        for record in list(missed(name))[:cases]:
            yield told(name, record)


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, help="so many misses of each study only")
    parser.add_argument("--studies", nargs="+", default=STUDIES, help="records that are read")
    parser.add_argument("--write", action="store_true", help="put the table into the docs")
    asked = parser.parse_args()
    lines = printed(table(asked.studies, asked.cases))
    if asked.write:
        report.write(study.DOCS, "misses", "\n".join(lines))


if __name__ == "__main__":
    main()
