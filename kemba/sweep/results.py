"""The table of a sweep: results, how many succeeded, and what they depend on."""

import csv
import sys
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kemba.config import Document, dump_yaml
from kemba.errors import KembaError
from kemba.files import atomic_text, write_json
from kemba.folders import LOCK
from kemba.runs import now, read_manifest, versions
from kemba.scenarios.share import wilson
from kemba.sweep.cases import Case, Record, Sweep
from kemba.sweep.farm import machine
from kemba.units import read_si

FEWEST = 5  # cases below which a correlation says nothing
CHANCE = 0.05  # p-value above which it may be chance (the usual 5 %)


def influence(rows: list[tuple[Case, Record | None]]) -> dict[str, Any]:
    """Spearman's rank correlations of each varied number with apex and landing.

    A condition that varies about zero may matter equally on both sides, which ranks cannot show;
    its size is added as `|start.body/pitch|`. `costs_most`: the condition with the strongest one,
    landing first, apex where all or none landed; None when each may be due to chance.
    """
    done = [(case, record) for case, record in rows if record and "apex_m" in record]
    landed = np.array([float(record["good"]) for _, record in done])
    apex = np.array([record["apex_m"] for _, record in done], dtype=float)
    ranks = {
        key: {"landing": rank(values, landed), "apex": rank(values, apex)}
        for key, values in with_sizes(numbers([case for case, _ in done])).items()
    }
    return {"ranks": ranks, "costs_most": costliest(ranks)}


def costliest(ranks: dict[str, dict[str, Any]]) -> str | None:
    """The condition that matters most."""
    for answer in ("landing", "apex"):
        told = {
            key: abs(found[answer]["correlation"])
            for key, found in ranks.items()
            if found[answer] and found[answer]["p_value"] < CHANCE
        }
        if told:
            return max(told, key=lambda key: told[key])
    return None


def rank(x: np.ndarray, y: np.ndarray) -> dict[str, float] | None:
    """Spearman's correlation of `x` (n,) and `y` (n,) and its p-value; None where either is
    constant."""
    from scipy.stats import spearmanr

    if len(x) < FEWEST or np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return None
    found = spearmanr(x, y)
    return {"correlation": float(found.statistic), "p_value": float(found.pvalue)}


def with_sizes(columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The columns, each (cases,), and `|key|` for those with numbers on both sides of zero."""
    both = {key: values for key, values in columns.items() if values.min() < 0.0 < values.max()}
    return columns | {f"|{key}|": np.abs(values) for key, values in both.items()}


def numbers(cases: list[Case]) -> dict[str, np.ndarray]:
    """By key the column (cases,) of what varies in all of the cases and is a number, in SI
    units."""
    columns = {}
    for key in cases[0].values if cases else ():
        try:
            values = [read_si(case.values[key])[0] for case in cases]
        except (KeyError, ValueError):
            continue
        if key != "seed":
            columns[key] = np.array(values)
    return columns


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
    counts = Counter(record["status"] if record else "missing" for _, record in rows)
    return {
        "cases": len(rows),
        "succeeded": succeeded,
        "rate": succeeded / len(rows),
        "interval": [low, high],
        "unfinished": sum(counts[status] for status in UNFINISHED),
        "statuses": dict(counts),
        **{name: spread(_column(rows, name)) for name in (*TIMES, "iterations")},
        "cost_ratio": spread(ratios),
    }


def spread(values: Iterable[float]) -> dict[str, float] | None:
    """Least, median, 90th percentile and greatest of some numbers."""
    numbers = np.array(list(values), dtype=float)
    if not len(numbers):
        return None
    low, median, p90, high = np.percentile(numbers, [0, 50, 90, 100]).tolist()
    return {"min": low, "median": median, "p90": p90, "max": high}


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


MANIFEST = "manifest.json"
FORMULA = ("=", "+", "@", "\t", "\r")  # begins of formulas in spreadsheets ("-" begins numbers too)
FIGURES = (
    "status", "good", "sentence", "apex_m", "apex_error_m", "touchdown_error_s", "final_error_m",
    "fault", "pitch_rad", "duration_s", "solve_s", "solve_cpu_s", "build_s", "wall_s", "cpu_s",
    "iterations", "variables", "start", "refined", "replays",
)  # fmt: skip


def open_folder(out: str | Path | None, sweep: Sweep, document: Document) -> Path:
    """The folder of a sweep, `sweeps/<name>` by default; an existing one is continued. Raises
    KembaError when it holds something else, or another sweep."""
    path = Path("sweeps") / sweep.name if out is None else Path(out)
    manifest = path / MANIFEST
    if path.exists() and not path.is_dir():
        raise KembaError(f"--out {path}", "is a file", "a folder was expected")
    if path.is_dir() and any(item.name != LOCK for item in path.iterdir()):
        known = read_manifest(path) if manifest.is_file() else {}
        if known.get("sweep") != sweep.name:
            what = (
                f"holds the sweep '{known['sweep']}'" if "sweep" in known else "holds other files"
            )
            raise KembaError(f"--out {path}", what, hint="give another --out")
    facts = {"sweep": sweep.name, "status": "running", "command": sys.argv, "started": now()}
    write_json(manifest, {**facts, "machine": machine(), "versions": versions()})
    dump_yaml(document.data, path / "sweep.yaml")
    return path


def write_results(
    path: Path, sweep: Sweep, cases: Sequence[Case], records: Mapping[str, Record], status: str
) -> dict[str, Any]:
    """Table and summary of a sweep, as far as it came; the summary is returned."""
    summary = summarise(sweep, cases, records)
    manifest = read_manifest(path)
    manifest |= {"status": status, "finished": now(), "sentence": summary["sentence"]}
    table = _table(cases, records)
    facts = {key: manifest[key] for key in ("machine", "versions", "started", "finished")}
    write_json(path / "results.json", {**summary, "status": status, **facts, "cases": table})
    _write_csv(table, path / "results.csv")
    write_json(path / MANIFEST, manifest)
    return summary


def _table(cases: Sequence[Case], records: Mapping[str, Record]) -> list[dict[str, Any]]:
    best = best_known([(case, records.get(case.key)) for case in cases])
    rows = []
    for case in cases:
        record = records.get(case.key)
        shown = record or {"status": "missing", "good": False, "sentence": "not done yet"}
        rows.append(
            {
                "block": case.block,
                "case": case.index,
                "key": case.key,
                "values": dict(case.values),
                **{name: shown.get(name) for name in FIGURES},
                "cost": cost_of(record),
                "cost_ratio": cost_ratio(case, record, best),
            }
        )
    return rows


def _write_csv(table: list[dict[str, Any]], path: Path) -> None:
    keys = dict.fromkeys(key for row in table for key in row["values"])
    names = [name for name in table[0] if name != "values"]
    with atomic_text(path) as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([harmless(cell) for cell in (*names[:3], *keys, *names[3:])])
        for row in table:
            fixed = [row[name] for name in names]
            cells = [*fixed[:3], *(row["values"].get(key) for key in keys), *fixed[3:]]
            writer.writerow([harmless(cell) for cell in cells])


def harmless(cell: Any) -> Any:
    """A cell that no spreadsheet takes for a formula and runs."""
    return f"'{cell}" if isinstance(cell, str) and cell.startswith(FORMULA) else cell
