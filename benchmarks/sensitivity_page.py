"""The page of the sensitivity study: one line per threshold, made from its records."""

import dataclasses
import json
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kemba.settings import Settings

PAGE = Path(__file__).resolve().parents[1] / "benchmarks" / "pages" / "sensitivity.md"
FIRST = Path(__file__).with_name("sensitivity_first.md")  # tables whose records were not kept
LIMIT = 0.05  # share of verdicts that may change when a threshold is doubled
HEAD = """# Sensitivity to the thresholds

A threshold on which a verdict depends is a setting (`kemba/settings.py`) that is marked `decides`.
`benchmarks/sensitivity.py` halves and doubles each of them, one at a time, and counts the verdicts
that change. A verdict should follow from the data, so none of these numbers should matter much. A
threshold whose doubling changes more than 5 % of the verdicts is **bold**: it needs a reason better
than the one in its column *origin*, or has to be replaced by something derived.

*cases*: how many cases were run and read the setting; where none reads it, nothing can change.
Columns *half* and *double* count the cases that changed. Whole numbers are rounded; those that
halving leaves as they are show no change. This page is written by
`python benchmarks/sensitivity.py --report`.

What each rule of `discover` is worth is told by `benchmarks/ablation.py` ([tried](tried.md)).

The sample can have the tasks `stand`, `jump` and `hop`, which are solved from guesses. What has
been run of it stands at the head of each table, with the day. One case is more than 5 % of so
small a sample, so **bold** means: at least one case changed, and more cases are needed to say how
often. A plan that is `interrupted` took five times the usual iterations. No value leaves the range
in which it has a meaning: twice a share of 0.7 is 1.

There are two studies. The tables that come first are made from `benchmarks/sensitivity.jsonl`,
which later runs extend. Of the first study only its tables were kept; they stand at the end, and
the program has changed since.
"""
FOUND = """## What was found

- **Plans, second study**: 21 settings of `jump`, solved cold, were halved and doubled, and all 42
  plans are solved: the two barrier parameters that decide about `stand` do not decide here. Costs
  are 0.80 to 1.27 times, iterations 0.84 to 1.12 times those with all settings as they are. The
  cost changes by more than 2 % with six settings (8 of 42 plans). `hop` and the other settings of
  `jump` were not run, and of the robot cases only number 0 with its settings as they are.
- **Plans, first study**: how `stand` ends depends on two barrier parameters (one half, one double:
  five times the usual iterations); all other settings of the stages change its cost only (column
  *cost*). The program has many local optima, and each change may lead to another one. No threshold
  can be derived that avoids this. What helps is to begin from plans that are known to be cheap
  ([earlier runs](../../docs/continuing.md)), or from several starts
  (`kemba-opt solve TASK --starts 4`).
"""

Record = dict[str, Any]


@dataclass(frozen=True)
class Change:
    """One setting, times a factor."""

    cls: type[Settings]
    field: str
    factor: float

    @property
    def name(self) -> str:
        return f"{self.cls.__name__}.{self.field}"

    @property
    def about(self) -> dataclasses.Field[Any]:
        """The field with its metadata."""
        (found,) = (f for f in dataclasses.fields(self.cls) if f.name == self.field)  # type: ignore[arg-type]
        return found

    @property
    def value(self) -> Any:
        """What the setting becomes; whole numbers stay whole and at least one, and no value leaves
        the range in which it has a meaning."""
        old, most = self.about.default, self.about.metadata["at_most"]
        if isinstance(old, tuple):
            return tuple(v * self.factor for v in old)
        new = max(1, round(old * self.factor)) if isinstance(old, int) else old * self.factor
        return min(new, most)


def read(path: Path) -> list[Record]:
    """The records so far."""
    if not path.is_file():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line]


def write(changes: Sequence[Change], records: Sequence[Record]) -> None:
    """The whole page."""
    parts = [HEAD]
    if records:
        parts.append(section("Plans: how they end", changes, records))
    studied = {r["setting"] for r in records}
    first = FIRST.read_text(encoding="utf-8")
    parts += [FOUND, f"## The first study\n\nIts records were not kept.\n\n{first}"]
    missing = sorted(n for n in {c.name for c in changes} - studied if f"`{n}`" not in first)
    if missing:
        listed = ", ".join(f"`{name}`" for name in missing)
        parts.append(f"## Not studied yet\n\nNo case of these was run: {listed}.\n")
    PAGE.write_text("\n".join(parts), encoding="utf-8")
    print(f"{PAGE.name}: {len(records)} records")


def section(title: str, changes: Sequence[Change], records: Sequence[Record]) -> str:
    """The table, and what changed."""
    base = {r["case"]: r["answer"] for r in records if not r["setting"]}
    found: dict[str, dict[float, dict[str, Any]]] = defaultdict(lambda: defaultdict(dict))
    for r in records:
        if r["setting"]:
            found[r["setting"]][r["factor"]][r["case"]] = r["answer"]
    sample = len(base)
    days = sorted({r["date"] for r in records if "date" in r})
    run_on = f" Run on {' and '.join(days)}." if days else ""
    share = f"One case is {100 / len(base):.0f} %."
    lines = [f"## {title}", "", f"Sample: {sample} cases. {share}{run_on}", ""]
    lines += [
        "| setting | value | unit | cases | half | double "
        "| cost, iterations at half; double | origin |",
        "|---|---|---|---|---|---|---|---|",
    ]
    told, untouched, gone = [], [], []
    for name, by_factor in found.items():
        about = next((c.about for c in changes if c.name == name), None)
        flips = {f: flipped(base, by_factor[f]) for f in (0.5, 2.0)}
        if about is None:
            changed = f"half {len(flips[0.5])}, double {len(flips[2.0])}"
            gone.append(f"`{name}` ({changed} of {most_cases(by_factor)})")
            continue
        cases = {c for answers in by_factor.values() for c, a in answers.items() if a is not None}
        if not cases:
            untouched.append(f"`{name}`")
            continue
        large = len(flips[2.0]) > LIMIT * len(base)
        shown = f"**`{name}`**" if large else f"`{name}`"
        counts = f"{len(flips[0.5])} | {len(flips[2.0])}"
        origin = about.metadata["origin"].replace("|", "/")
        row = f"| {shown} | {about.default} | {about.metadata['unit']} | {len(cases)} | {counts}"
        lines.append(f"{row} | {costs(base, by_factor)} | {origin} |")
        told += [
            f"- `{name}` times {f:g}, {case}: {words(base[case])}, then {words(by_factor[f][case])}"
            for f, which in flips.items()
            for case in which
        ]
    if gone:
        lines += ["", f"Settings that are gone, with the cases that changed: {', '.join(gone)}."]
    if untouched:
        lines += ["", f"Read in none of these cases: {', '.join(untouched)}."]
    if told:
        lines += ["", "What changed:", "", *told]
    return "\n".join([*lines, ""])


def most_cases(by_factor: dict[float, dict[str, Any]]) -> int:
    """In how many cases a setting was studied."""
    return len({case for answers in by_factor.values() for case in answers})


def flipped(base: dict[str, Any], answers: dict[str, Any]) -> list[str]:
    """The cases whose verdict is another."""
    return [c for c, a in answers.items() if a is not None and key(a) != key(base[c])]


def key(answer: dict[str, Any]) -> tuple[Any, ...]:
    """What counts as a verdict."""
    return (answer["verdict"],)


def words(answer: dict[str, Any]) -> str:
    """A verdict in short."""
    parts = [f"cost {answer['cost']:.3g}"] if "cost" in answer else []
    return f"{answer['verdict']} ({', '.join(parts)})" if parts else str(answer["verdict"])


def costs(base: dict[str, Any], by_factor: dict[float, dict[str, Any]]) -> str:
    """Mean ratio of cost and iterations to the plan with all settings as they are."""
    return "; ".join(
        f"{mean(base, by_factor[f], 'cost')}, {mean(base, by_factor[f], 'iterations')}"
        for f in (0.5, 2.0)
    )


def mean(base: dict[str, Any], answers: dict[str, Any], what: str) -> str:
    """Mean ratio over the good plans."""
    ratios: Iterable[float] = [
        a[what] / base[c][what]
        for c, a in answers.items()
        if a is not None and a["verdict"] == base[c]["verdict"] == "solved" and base[c][what]
    ]
    return f"{sum(ratios) / len(list(ratios)):.2f}" if ratios else "-"
