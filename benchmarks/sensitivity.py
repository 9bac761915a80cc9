# ruff: noqa: E402  (the twin is found first)
"""What hangs on the thresholds? Each one is halved and doubled over a fixed sample of cases.

    python benchmarks/sensitivity.py --bench 12 --robot 8 --part 1/2 --jobs 1
    python benchmarks/sensitivity.py --verbs schedule --only Relaxation
    python benchmarks/sensitivity.py --report                     # writes docs/sensitivity.md

`discover` and `compare`: the first cases of the blind studies, made by the twin in tests/twin.
`schedule`: the shipped tasks. Only settings marked `decides` are changed, one at a time. A case
is run again from the first stage on that reads the setting; where no stage reads it, nothing can
change and nothing is run. Results are kept in the file, so an interrupted study goes on where it
stopped; its parts may run at the same time.
"""

from __future__ import annotations

import argparse
import copy
import dataclasses
import importlib
import json
import os
import pkgutil
import re
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import Any
from unittest.mock import patch

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]

from sensitivity_page import Change, read, write

import kemba.identify
import kemba.ocp
from kemba.settings import Settings, changed

TASKS = ("stand", "jump", "hop", "max_jump", "drop", "jump_forward")
UNHURRIED = ["solver.time_limit=900"]  # a busy machine must not decide
FACTORS = (0.5, 2.0)
Stages = Sequence[tuple[str, Callable[[Any], Any]]]


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


@contextmanager
def recorded() -> Iterator[set[type[Settings]]]:
    """The classes of settings that are read within this block."""
    seen: set[type[Settings]] = set()
    plain = Settings.current.__func__  # type: ignore[attr-defined]

    def current(cls: type[Settings]) -> Settings:
        seen.add(cls)
        return plain(cls)  # type: ignore[no-any-return]

    with patch.object(Settings, "current", classmethod(current)):
        yield seen


class Case:
    """One case, run stage by stage; each stage makes something of what the one before made."""

    def __init__(self, name: str, stages: Stages) -> None:
        self.name, self.stages = name, stages
        self.states: list[Any] = [None]
        self.reads: list[set[type[Settings]]] = []

    def base(self) -> Any:
        """The answer with all settings as they are."""
        for _, stage in self.stages:
            with recorded() as seen:
                self.states.append(stage(kept(self.states[-1])))
            self.reads.append(seen)
        return self.states[-1]

    def answer(self, change: Change) -> Any | None:
        """The answer with one setting changed; None where no stage reads it."""
        first = next((i for i, seen in enumerate(self.reads) if change.cls in seen), None)
        if first is None:
            return None
        state = kept(self.states[first])
        with changed(change.cls, **{change.field: change.value}):
            for _, stage in self.stages[first:]:
                state = stage(state)
        return state


def kept(state: Any) -> Any:
    """A copy that later stages may change. Problems do not change, and are not copied."""
    if not isinstance(state, tuple):
        return state
    search = state[0]
    shared = (search.problem, search.base.problem, search.base.division.problem)
    return copy.deepcopy(state, {id(p): p for p in shared})


def remembered(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """A slow function of theta, called again only where the settings that it reads have changed."""
    store: list[tuple[Any, dict[type[Settings], Settings], Any]] = []

    def call(theta: Any) -> Any:
        asked = tuple(sorted(theta.items()))
        for key, values, answer in store:
            if key == asked and all(cls.current() == value for cls, value in values.items()):
                return answer
        with recorded() as seen:
            answer = function(theta)
        store.append((asked, {cls: cls.current() for cls in seen}, answer))
        return answer

    return call


def discovery(name: str, kind: str, setting: dict[str, Any], folder: Path) -> Case:
    """A case of a blind study: checks, problem, search, answer."""
    from blind import bench, robot

    from kemba.identify.bench.problem import bench_problem
    from kemba.identify.compare.compare import compare
    from kemba.identify.discover import judged
    from kemba.identify.evidence.search import Search
    from kemba.identify.logs.gate import BadData, check_logs
    from kemba.identify.logs.reading import read_logs
    from kemba.identify.robot.problem import robot_problem
    from kemba.model.spec import load_model

    paths = (bench if kind == "bench" else robot).logs_of(setting, folder)[0]
    logs = read_logs(paths)

    def problem(_: Any) -> Any:
        try:
            check_logs(logs)
            if kind == "bench":
                model = load_model(bench.MODELS[setting["chambers"]], rig=True)
                found: Any = bench_problem(logs, model)
            else:
                found = robot_problem(logs, load_model())
            found.validate()
        except BadData:
            return None
        return found

    def searched(found: Any) -> Any:
        if found is None:
            return None
        search = Search(found)
        best = search.run()
        search.problem.leftover = remembered(search.problem.leftover)
        return search, best

    def answered(state: Any) -> dict[str, Any]:
        if state is None:
            return {"verdict": "bad-data", "added": [], "same": []}
        answer = judged(*state).answer
        rows = [r for r in answer.ranking if r.effect in answer.added]
        same = sorted({other for r in rows for other in r.equivalent_to})
        return {"verdict": answer.verdict, "added": sorted(answer.added), "same": same}

    def compared(found: Any) -> dict[str, Any]:
        if found is None:
            return {"verdict": "bad-data", "hints": []}
        done = compare(found, "model")
        kinds = sorted({hint.kind for hint in done.hints})
        grade = "good" if done.good else "tolerable" if done.tolerable else "bad"
        return {"verdict": grade, "hints": kinds}

    if name.startswith("compare"):
        return Case(name, [("problem", problem), ("compare", compared)])
    return Case(name, [("problem", problem), ("search", searched), ("answer", answered)])


def planning(name: str) -> Case:
    """A shipped task, planned."""
    from kemba.ocp import load_task, plan

    def planned(_: Any) -> dict[str, Any]:
        task, document = load_task(f"{name.removeprefix('schedule:')}.yaml", UNHURRIED)
        found = plan(task, document)
        good = bool(found.status.good)
        return {
            "verdict": "good" if good else "bad",
            "status": str(getattr(found.status, "value", found.status)),
            "cost": float(sum(found.cost.values())),
            "iterations": int(found.iterations),
        }

    return Case(name, [("plan", planned)])


def names(options: argparse.Namespace) -> list[str]:
    """Names of all cases asked for: study:number, or schedule:task."""
    kinds = [("bench", options.bench), ("robot", options.robot)]
    numbers = [(i, kind) for kind, count in kinds for i in range(count)]
    logs = [v for v in ("discover", "compare") if v in options.verbs]
    found = [f"{verb}:{kind}:{i}" for i, kind in sorted(numbers) for verb in logs]
    return found + [f"schedule:{task}" for task in TASKS if "schedule" in options.verbs]


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
    done = {(r["case"], r["setting"], r["factor"]) for r in read(out)}
    pending = [c for c in changes if (name, c.name, c.factor) not in done]
    if not pending:
        return f"{name}: done before"
    with tempfile.TemporaryDirectory() as folder:
        try:
            case = make(name, Path(folder))
        except RuntimeError as error:  # the twin cannot do this case
            return f"{name}: left out, {error}"
        base = case.base()
        if (name, "", 1.0) not in done:
            append(out, {"case": name, "setting": "", "factor": 1.0, "answer": base})
        for change in pending:
            try:
                answer = case.answer(change)
            except Exception as error:  # an absurd value may break anything: that is a finding
                answer = {"verdict": f"error: {type(error).__name__}"}
            record = {"case": name, "setting": change.name, "factor": change.factor}
            append(out, {**record, "answer": answer})
    return f"{name}: {len(pending)} settings"


def append(out: Path, record: dict[str, Any]) -> None:
    """One more line of the file."""
    with out.open("a", encoding="utf-8") as stream:
        stream.write(json.dumps(record) + "\n")


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bench", type=int, default=12, help="so many bench cases")
    parser.add_argument("--robot", type=int, default=8, help="so many robot cases")
    parser.add_argument("--verbs", default="discover,compare", help="also: schedule")
    parser.add_argument("--only", default="", help="settings whose Class.field matches this")
    parser.add_argument("--out", type=Path, default=Path("sensitivity.jsonl"))
    parser.add_argument("--part", default="1/1", help="i/n: every n-th case, from the i-th on")
    parser.add_argument("--jobs", type=int, default=1, help="cases at the same time")
    parser.add_argument("--report", action="store_true", help="run nothing, write the page")
    options = parser.parse_args()
    if not options.report:
        part, parts = (int(p) for p in options.part.split("/"))
        chosen = names(options)[part - 1 :: parts]
        words = [(name, options.only, options.out) for name in chosen]
        with ProcessPoolExecutor(options.jobs, get_context("spawn")) as pool:
            for line in pool.map(run, *zip(*words, strict=True)):
                print(line, flush=True)
    packages = (kemba.identify, kemba.ocp)
    write([c for package in packages for c in deciding(package)], read(options.out))


if __name__ == "__main__":
    main()
