"""A sweep's folder: what was asked, every case's result, the table and the summary."""

from __future__ import annotations

import csv
import sys
from collections.abc import Mapping, Sequence
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from kemba.config import Document, dump_yaml
from kemba.errors import KembaError
from kemba.files import atomic_text, write_json
from kemba.folders import LOCK
from kemba.runs import read_manifest, versions
from kemba.sweep.cases.case import Case, Record
from kemba.sweep.cases.schema import Sweep
from kemba.sweep.table.summary import best_known, cost_of, cost_ratio, summarise
from kemba.sweep.workers.machine import machine

MANIFEST = "manifest.json"
FORMULA = (
    "=",
    "+",
    "@",
    "\t",
    "\r",
)  # begins of formulas in spreadsheets ("-" begins numbers too)
FIGURES = (
    "status", "good", "sentence", "apex_m", "apex_error_m", "touchdown_error_s", "final_error_m",
    "fault", "pitch_rad", "duration_s", "solve_s", "solve_cpu_s", "build_s", "wall_s", "cpu_s",
    "iterations", "variables", "start", "refined", "replays",
)  # fmt: skip


def open_folder(out: str | Path | None, sweep: Sweep, document: Document) -> Path:
    """The folder of a sweep, `sweeps/<name>` by default; an existing one is continued.

    Raises KembaError when it holds something else, or another sweep.
    """
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
    facts = {
        "sweep": sweep.name,
        "status": "running",
        "command": sys.argv,
        "started": _now(),
        "machine": machine(),
        "versions": versions(),
    }
    write_json(manifest, facts)
    dump_yaml(document.data, path / "sweep.yaml")
    return path


def write_results(
    path: Path, sweep: Sweep, cases: Sequence[Case], records: Mapping[str, Record], status: str
) -> dict[str, Any]:
    """Table and summary of a sweep, as far as it came; the summary is returned."""
    summary = summarise(sweep, cases, records)
    manifest = read_manifest(path)
    manifest |= {"status": status, "finished": _now(), "sentence": summary["sentence"]}
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


def _now() -> str:
    return datetime.now(timezone.utc).isoformat(timespec="seconds")
