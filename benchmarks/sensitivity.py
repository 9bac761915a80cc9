# ruff: noqa: E402  (the twin is found first)
"""How much depends on the thresholds? Each one is halved and doubled over a fixed sample of cases.

    python benchmarks/sensitivity.py --part 1/2 --jobs 1
    python benchmarks/sensitivity.py --only Relaxation
    python benchmarks/sensitivity.py --report    # writes benchmarks/pages/sensitivity.md

The cases are shipped tasks. Only settings marked `decides` are changed, one at a time. A case is
run again from the first stage on that reads the setting; where no stage reads it, nothing can
change and nothing is run. Results are kept in benchmarks/sensitivity.jsonl with the day on which
they were run: an interrupted study goes on where it stopped, and the page says how old its figures
are. Later lines replace earlier ones. Parts of a study may run at the same time.
"""

import argparse
import dataclasses
import importlib
import json
import os
import pkgutil
import re
import sys
from concurrent.futures import ProcessPoolExecutor
from datetime import datetime, timezone
from multiprocessing import get_context
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]

from sensitivity_cases import planning
from sensitivity_page import Change, read, write

import kemba.ocp
from kemba.settings import Settings

TASKS = ("stand", "jump", "hop")
FACTORS = (0.5, 2.0)
RECORDS = ROOT / "benchmarks" / "sensitivity.jsonl"


def deciding(package: Any, only: str = "") -> list[Change]:
    """The marked settings of a package, halved and doubled."""
    for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        importlib.import_module(module.name)
    found = []
    for cls in Settings.classes:
        if not cls.__module__.startswith(package.__name__):
            continue
        for field in dataclasses.fields(cls):  # type: ignore[arg-type]
            name = f"{cls.__name__}.{field.name}"
            if field.metadata["decides"] and re.search(only, name):
                found += [Change(cls, field.name, factor) for factor in FACTORS]
    return found


def run(name: str, only: str, out: Path) -> str:
    """Everything about one case that the file does not have yet."""
    changes = deciding(kemba.ocp, only)
    own = {(r["setting"], r["factor"]): r["answer"] for r in read(out) if r["case"] == name}
    pending = [c for c in changes if (c.name, c.factor) not in own]
    if not pending:
        return f"{name}: done before"
    case = planning(name)
    base = case.base()
    if own.get(("", 1.0)) != base:  # new, or the program answers otherwise by now
        append(out, {"case": name, "setting": "", "factor": 1.0, "answer": base})
        pending = changes
    for change in pending:
        try:
            answer = case.answer(change)
        except Exception as error:  # an absurd value may break anything: that is a finding
            answer = {"verdict": f"error: {type(error).__name__}"}
        record = {"case": name, "setting": change.name, "factor": change.factor}
        append(out, {**record, "answer": answer})
    return f"{name}: {len(pending)} settings"


def append(out: Path, record: dict[str, Any]) -> None:
    """One more line of the file, with today's date."""
    record = {"date": datetime.now(tz=timezone.utc).date().isoformat(), **record}
    with out.open("a", encoding="utf-8") as stream:
        stream.write(json.dumps(record) + "\n")


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", default="", help="cases whose name matches this")
    parser.add_argument("--only", default="", help="settings whose Class.field matches this")
    parser.add_argument("--out", type=Path, default=RECORDS)
    parser.add_argument("--part", default="1/1", help="i/n: every n-th case, from the i-th on")
    parser.add_argument("--jobs", type=int, default=1, help="cases at the same time")
    parser.add_argument("--report", action="store_true", help="run nothing, write the page")
    options = parser.parse_args()
    if not options.report:
        part, parts = (int(p) for p in options.part.split("/"))
        chosen = [n for t in TASKS if re.search(options.cases, n := f"schedule:{t}")]
        chosen = chosen[part - 1 :: parts]
        words = [(name, options.only, options.out) for name in chosen]
        with ProcessPoolExecutor(options.jobs, get_context("spawn")) as pool:
            for line in pool.map(run, *zip(*words, strict=True)):
                print(line, flush=True)
    write(deciding(kemba.ocp), read(options.out))


if __name__ == "__main__":
    main()
