# ruff: noqa: E402  (the twin is found first)
"""How much depends on the thresholds? Each one is halved and doubled over a fixed sample of cases.

    python benchmarks/sensitivity.py --part 1/2 --jobs 1
    python benchmarks/sensitivity.py --verbs schedule --only Relaxation
    python benchmarks/sensitivity.py --report              # writes benchmarks/pages/sensitivity.md

`discover` and `compare`: cases of the blind studies, made by the twin in tests/twin. `schedule`:
shipped tasks. Only settings marked `decides` are changed, one at a time. A case is run again from
the first stage on that reads the setting; where no stage reads it, nothing can change and nothing
is run. Results are kept in benchmarks/sensitivity.jsonl with the day on which they were run: an
interrupted study goes on where it stopped, and the page says how old its figures are. Later lines
replace earlier ones. Parts of a study may run at the same time.
"""

from __future__ import annotations

import argparse
import dataclasses
import importlib
import json
import os
import pkgutil
import re
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from datetime import datetime, timezone
from multiprocessing import get_context
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]

from sensitivity_cases import Case, discovery, planning
from sensitivity_page import Change, read, write

import kemba.identify
import kemba.ocp
from kemba.settings import Settings

# The fixed sample: cases of the blind studies, and shipped tasks.
BENCH = tuple(range(12))  # six effects, three unknown ones, three times nothing
ROBOT = (0, 2, 3, 25)  # hip_spring, nothing, seal_friction, an effect that is unknown
TASKS = ("stand", "jump", "hop")
FACTORS = (0.5, 2.0)
RECORDS = ROOT / "benchmarks" / "sensitivity.jsonl"
VERBS = ("discover", "compare", "schedule")


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


def names(verbs: str, match: str) -> list[str]:
    """Names of the cases asked for, the cheap ones first: study:number, or schedule:task."""
    logs = [f"bench:{i}" for i in BENCH], [f"robot:{i}" for i in ROBOT]
    found = [f"{verb}:{log}" for kind in logs for log in kind for verb in VERBS[:2]]
    found += [f"schedule:{task}" for task in TASKS]
    return [n for n in found if n.partition(":")[0] in verbs and re.search(match, n)]


def make(name: str, folder: Path) -> Case:
    """The case of a name."""
    if name.startswith("schedule"):
        return planning(name)
    from blind import bench, robot

    _, kind, number = name.split(":")
    setting = (bench if kind == "bench" else robot).cases()[int(number)]
    return discovery(name, kind, setting, folder)


def run(name: str, only: str, out: Path) -> str:
    """Everything about one case that the file does not have yet."""
    changes = deciding(kemba.ocp if name.startswith("schedule") else kemba.identify, only)
    own = {(r["setting"], r["factor"]): r["answer"] for r in read(out) if r["case"] == name}
    pending = [c for c in changes if (c.name, c.factor) not in own]
    if not pending:
        return f"{name}: done before"
    with tempfile.TemporaryDirectory() as folder:
        try:
            case = make(name, Path(folder))
        except RuntimeError as error:  # the twin cannot do this case
            return f"{name}: left out, {error}"
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
    parser.add_argument("--verbs", default=",".join(VERBS), help="which verbs are studied")
    parser.add_argument("--cases", default="", help="cases whose name matches this")
    parser.add_argument("--only", default="", help="settings whose Class.field matches this")
    parser.add_argument("--out", type=Path, default=RECORDS)
    parser.add_argument("--part", default="1/1", help="i/n: every n-th case, from the i-th on")
    parser.add_argument("--jobs", type=int, default=1, help="cases at the same time")
    parser.add_argument("--report", action="store_true", help="run nothing, write the page")
    options = parser.parse_args()
    if not options.report:
        part, parts = (int(p) for p in options.part.split("/"))
        chosen = names(options.verbs, options.cases)[part - 1 :: parts]
        words = [(name, options.only, options.out) for name in chosen]
        with ProcessPoolExecutor(options.jobs, get_context("spawn")) as pool:
            for line in pool.map(run, *zip(*words, strict=True)):
                print(line, flush=True)
    packages = (kemba.identify, kemba.ocp)
    write([c for package in packages for c in deciding(package)], read(options.out))


if __name__ == "__main__":
    main()
