"""The section of docs/learn.md from the record of benchmarks/learning.py."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from kemba.scenarios.share import wilson

Row = dict[str, Any]
GOOD = 5e-3  # m, the apex error that is aimed at


def section(rows: Sequence[Row]) -> str:
    """Errors by round and way, landings, and what happened on every machine."""
    seeds = sorted({row["seed"] for row in rows})
    text = [
        f"Machines run: {len(seeds)}, with three to five hidden effects each; three jumps",
        "before learning and after every round. Apex error of a round: mean of its three jumps",
        "against the plan that was executed, as it truly is. In brackets how many machines are",
        "within 5 mm, with Wilson's interval of 95 %.",
        "",
    ]
    return "\n".join([*text, *_table(rows), "", *_machines(rows), "", _machine(rows)])


def mixed(rows: Sequence[Row]) -> str:
    """The same of machines of which half have other chambers, and how often the expected band
    holds an apex."""
    groups = {c: [r for r in rows if r["chambers"] == c] for c in ("first_order", "orifice")}
    last = max(len(row["rounds"]) for row in rows)
    names = ["before", *(f"round {k}" for k in range(1, last))]
    text = [
        f"Other machines: {len(rows)}, every second one with air that flows through orifices.",
        "",
        f"| median error [mm] | machines | {' | '.join(names)} | landings kept "
        "| apexes within the expected band | CPU s a round |",
        "|---|---|" + "---|" * (last + 3),
    ]
    for name, own in {**groups, "all": list(rows)}.items():
        if not own:
            continue
        cells = [_cell_of(column, len(own)) for column in np.abs([errors(row) for row in own]).T]
        inside = [x for row in own for x in _inside(row)]
        share = f"{sum(inside)} of {len(inside)} ({_interval(sum(inside), len(inside))})"
        cpu = np.median([row["cpu_s"] / (last - 1) for row in own])
        held = f"{sum(map(kept, own))} of {len(own)}"
        told = [name.replace("_", " "), str(len(own)), *cells, held, share, f"{cpu:.0f}"]
        text.append(f"| {' | '.join(told)} |")
    return "\n".join([*text, "", _machine(rows)])


def _inside(row: Row) -> Iterator[bool]:
    """Whether each jump after a round reached an apex within the band that the round expected,
    where its plan was good and so was executed."""
    for fact, found in zip(row["facts"], row["rounds"][1:], strict=True):
        if fact.get("good") and (band := fact.get("expected_m")):
            yield from (band[0] <= apex <= band[1] for apex in found["apex_m"])


def _ways(rows: Sequence[Row]) -> list[str]:
    return list(dict.fromkeys(row["way"] for row in rows))


def errors(row: Row) -> np.ndarray:
    """Mean apex error [m] of each round."""
    return np.array([np.mean(r["apex_error_m"]) for r in row["rounds"]])


def kept(row: Row) -> bool:
    """Whether every landing was kept."""
    return all(all(r["landed"]) for r in row["rounds"])


def _table(rows: Sequence[Row]) -> Iterator[str]:
    rounds = max((len(row["rounds"]) for row in rows), default=0)
    names = ["before", *(f"round {k}" for k in range(1, rounds))]
    yield f"| median error [mm] | machines | {' | '.join(names)} | landings kept | CPU s |"
    yield "|---|---|" + "---|" * (rounds + 2)
    for way in _ways(rows):
        own = [row for row in rows if row["way"] == way]
        found = np.abs([errors(row) for row in own])
        cells = [_cell_of(column, len(own)) for column in found.T]
        held = sum(map(kept, own))
        cpu = np.median([row["cpu_s"] for row in own])
        yield f"| {way} | {len(own)} | {' | '.join(cells)} | {held} of {len(own)} | {cpu:.0f} |"


def _cell_of(column: np.ndarray, count: int) -> str:
    """Median error of a round, and how many of `count` machines are within 5 mm."""
    good = int((column <= GOOD).sum())
    return f"{1e3 * np.median(column):.1f} ({good}: {_interval(good, count)})"


def _interval(good: int, count: int) -> str:
    low, high = (100 * end for end in wilson(good, count))
    return f"{low:.0f} to {high:.0f} %"


def _machines(rows: Sequence[Row]) -> Iterator[str]:
    yield "| machine | hidden effects | " + " | ".join(_ways(rows)) + " |"
    yield "|---|---|" + "---|" * len(_ways(rows))
    for seed in sorted({row["seed"] for row in rows}):
        own = {row["way"]: row for row in rows if row["seed"] == seed}
        hidden = ", ".join(next(iter(own.values()))["effects"])
        yield f"| {seed} | {hidden} | " + " | ".join(map(_cell, map(own.get, _ways(rows)))) + " |"


def _cell(row: Row | None) -> str:
    if row is None:
        return "not run"
    told = " ".join(f"{1e3 * e:+.1f}" for e in errors(row))
    failed = sum("failed" in fact for fact in row["facts"])
    marks = ["" if kept(row) else "falls", f"{failed} rounds fail" if failed else ""]
    return ", ".join([told, *filter(None, marks)])


def _machine(rows: Sequence[Row]) -> str:
    return f"Computed on: {'; '.join(sorted({row['machine'] for row in rows}))}."
