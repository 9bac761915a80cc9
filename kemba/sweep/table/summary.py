"""What a sweep found: success rates with their intervals, times, costs against the best known."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from kemba.scenarios.rate import wilson
from kemba.sweep.cases.case import Case, Record
from kemba.sweep.cases.schema import Sweep
from kemba.sweep.table.influence import influence

Rows = list[tuple[Case, Record | None]]
TIMES = ("build_s", "solve_s", "solve_cpu_s", "wall_s", "cpu_s")
UNFINISHED = ("error", "lost", "missing")


def summarise(sweep: Sweep, cases: Sequence[Case], records: Mapping[str, Record]) -> dict[str, Any]:
    """The summary of every block, whether all is as expected, and a sentence."""
    rows = [(case, records.get(case.key)) for case in cases]
    best = best_known(rows)
    blocks = {}
    for name, block in sweep.blocks.items():
        own = [(case, record) for case, record in rows if case.block == name]
        summary = _block(own, best)
        if block.kind == "execute":
            summary |= {"apex_m": spread(_column(own, "apex_m"))} | influence(own)
        met = summary["rate"] >= block.expect and not summary["unfinished"]
        blocks[name] = {"kind": block.kind, **summary, "expected": block.expect, "met": met}
    bad = [name for name, block in blocks.items() if not block["met"]]
    told = [f"{name}: {sentence(block)}" for name, block in blocks.items()]
    return {"sweep": sweep.name, "good": not bad, "sentence": "; ".join(told), "blocks": blocks}


def sentence(block: Mapping[str, Any]) -> str:
    """A block's summary in words."""
    word = {"solve": "solved", "execute": "landed"}[block["kind"]]
    low, high = (100 * end for end in block["interval"])
    rate = f"{block['succeeded']} of {block['cases']} {word} (95 %: {low:.1f} to {high:.1f} %)"
    if block["unfinished"]:
        rate += f", {block['unfinished']} without an answer"
    if (time := block["solve_s"]) and block["kind"] == "solve":
        rate += f", median {time['median']:.2f} s, max {time['max']:.2f} s"
    if block.get("costs_most"):
        rate += f", {block['costs_most']} costs most"
    return rate


def _block(rows: Rows, best: Mapping[str, float]) -> dict[str, Any]:
    records = [record for _, record in rows if record]
    succeeded = sum(bool(record["good"]) for record in records)
    low, high = wilson(succeeded, len(rows))
    ratios = [r for case, record in rows if (r := cost_ratio(case, record, best)) is not None]
    counts: dict[str, int] = {}
    for _, record in rows:
        status = record["status"] if record else "missing"
        counts[status] = counts.get(status, 0) + 1
    return {
        "cases": len(rows),
        "succeeded": succeeded,
        "rate": succeeded / len(rows),
        "interval": [low, high],
        "unfinished": sum(counts.get(status, 0) for status in UNFINISHED),
        "statuses": counts,
        **{name: spread(_column(rows, name)) for name in (*TIMES, "iterations")},
        "cost_ratio": spread(ratios),
    }


def spread(values: Iterable[float]) -> dict[str, float] | None:
    """Least, median, 90th percentile and greatest of some numbers."""
    numbers = np.array(list(values), dtype=float)
    if not len(numbers):
        return None
    return {
        "min": float(numbers.min()),
        "median": float(np.median(numbers)),
        "p90": float(np.percentile(numbers, 90)),
        "max": float(numbers.max()),
    }


def _column(rows: Rows, name: str) -> list[float]:
    return [record[name] for _, record in rows if record and record.get(name) is not None]


def cost_of(record: Record | None) -> float | None:
    """The squared hip torque, integrated over time, of a good plan."""
    if not record or not record["good"]:
        return None
    cost: float | None = (record.get("cost") or {}).get("torque_squared_integral")
    return cost


def best_known(rows: Rows) -> dict[str, float]:
    """The least cost of each problem that was solved more than once."""
    costs: dict[str, list[float]] = {}
    for case, record in {case.key: (case, record) for case, record in rows}.values():
        cost = cost_of(record)
        if cost is not None:
            costs.setdefault(case.problem, []).append(cost)
    return {problem: min(found) for problem, found in costs.items() if len(found) > 1}


def cost_ratio(case: Case, record: Record | None, best: Mapping[str, float]) -> float | None:
    """Cost against the best known of the same problem; None when it was solved only once."""
    cost, least = cost_of(record), best.get(case.problem)
    return cost / least if cost is not None and least else None
