# ruff: noqa: E402  (the twin is found first)
"""What every rule of `discover` is worth: blind cases answered with it and without it, in pairs.

    python benchmarks/ablation.py --study bench --cases 40
    python benchmarks/ablation.py --study bench --cases 40 --without "swaps,secants"
    python benchmarks/ablation.py --study bench --cases 100:120 --recorded
    python benchmarks/ablation.py --report [--write]

A rule is a function of the search, of the doubts or of the verdict that is replaced from outside
by one that does nothing; the program itself has no switches. Each case is answered as it is, which
rules acted is noted, and it is answered again without each of these. `--without`: without several
rules at once. `--recorded`: cases are answered by the program as it is, beside their recorded
answers, which the program with all of its former rules gave. Predictions are kept within a case, so
that an answer costs only what differs. No answer has a time limit. Results are kept in
benchmarks/ablation.jsonl: an interrupted study goes on where it stopped.
"""

import argparse
import os
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any
from unittest.mock import patch

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]

import numpy as np
from ablation_page import table, write
from blind import bench, report, robot, second
from blind.kinds import Record, hidden, kind, named

from kemba.identify.bench.problem import BenchProblem
from kemba.identify.discover import discover
from kemba.identify.infer.cross_validation import Gain
from kemba.identify.infer.joint import JointFit
from kemba.identify.robot.problem import RobotProblem

STUDIES = {"bench": bench, "robot": robot, "second": second}
RECORDS = ROOT / "benchmarks" / "ablation.jsonl"
HOME = "kemba.identify."
GONE = "all that are gone"  # rules that the program has no more


@dataclass(frozen=True)
class Rule:
    """`at`: `module:function` or `module:Class.method`; `off`: what replaces it; `acts`: whether a
    call that returned `result` did anything (None: it is told by whether `off` returns the same).
    `only`: replaced in this module alone. `values`: of settings instead, in the class `at`."""

    name: str
    at: str
    off: Callable[..., Any] | None = None
    acts: Callable[..., bool] | None = None
    only: str = ""
    values: dict[str, Any] | None = None


def always(*_: Any, **__: Any) -> bool:
    """Acts in every answer."""
    return True


def plain_error(gains: np.ndarray, apart: np.ndarray) -> Gain:
    """Gain with the usual standard error of a sum."""
    n = len(gains)
    return Gain(float(gains.sum()), float(np.sqrt(n * np.var(gains, ddof=1))) if n > 1 else 0.0)


def once(search: Any, hypothesis: Any) -> Any:
    """The motion found once, however late sensors are."""
    theta = search.points[hypothesis].fit.theta
    search.problem = search.problem.relinearise(theta)
    return theta


class NoThreshold:
    """A bootstrap that asks for nothing."""

    threshold = 0.0

    def p_value(self, gain: float) -> float:
        return 0.0


def _differs(result: Any, search: Any, best: Any, *_: Any) -> bool:
    return bool(result != best)


SEARCH, PARSIMONY, FORMULA = "infer.search:Search.", "infer.selection:", "infer.formula"
RULES = [
    Rule("late sensors stay", SEARCH + "_settle", once,
         lambda result, s, h: bool(s.problem.held_back(result))),
    Rule("swaps", SEARCH + "_swap", lambda s, best: best, _differs),
    Rule("followed twice", "infer.search:FOLLOWED", values={"FOLLOWED": 1}),
    Rule("colour anew", "infer.null_model:Baseline.seen_from", lambda b, theta: None, always),
    Rule("drifting sensors", "infer.null_model:_with_drift", lambda p, theta: p,
         lambda result, p, theta: result is not p),
    Rule("spikes", "problem.noise:caution", lambda r: None,
         lambda result, r: bool(np.any(result < 1.0))),
    Rule("three tolerances", "infer.linear:SpikeSlabSettings",
         values={"tolerances": (1.0,)}),
    Rule("steps to the mode", "infer.null_model:ROUNDS", values={"ROUNDS": 0}),
    Rule("enlarged noise", "infer.significance:_enlarged",
         lambda own, left, root, power: own.T @ left, always),
    Rule("material", "infer.selection:material", lambda s, h: h),
    Rule("rows refute", PARSIMONY + "is_refuted", lambda *_: False),
    Rule("simplest", PARSIMONY + "simplest", lambda s, belief: belief,
         lambda result, s, belief: result.best != belief.best),
    Rule("overclaimed", PARSIMONY + "overclaimed", lambda *_: False),
    Rule("idle", PARSIMONY + "is_unsupported", lambda *_: False),
    Rule("one part shows", "infer.cross_validation:one_part_shows", lambda *_: False),
    Rule("figures' share of a gain", "infer.cross_validation:figures_off", lambda *_: 0.0, always),
    Rule("ratio error", "infer.cross_validation:gained", plain_error, always),
    Rule("written by folds", "infer.selection:predictive", lambda s, best, likeliest: best),
    Rule("strong ones written", "infer.selection:STRONG", values={"STRONG": np.inf}),
    Rule("formulas", FORMULA + ":look", lambda s, best: None),
    Rule("formula: bootstrap", "infer.significance:bootstrap", lambda *_: NoThreshold(), always,
         only=FORMULA),
    Rule("formula: drifts", "infer.formula:drift_columns",
         lambda p: (np.empty((len(p.rows()), 0)), np.empty(0)),
         lambda result, p: bool(result[0].size)),
    Rule("unfinished", "infer.verdict:unfinished", lambda *_: False),
    Rule("pattern left", "infer.verdict:pattern_left", lambda *_: ""),
    Rule("mixture", "infer.structure:is_mixture", lambda share: False),
    Rule("nothing explains", "answer:VerdictSettings", values={"unexplained": -1.0}),
    Rule("error left", "answer:VerdictSettings", values={"whole": np.inf}),
    Rule("part of structure", "answer:VerdictSettings", values={"part_of_structure": 0.1}),
    Rule("equivalents", "infer.verdict:equivalents", lambda *_: ()),
]  # fmt: skip
BY_NAME = {rule.name: rule for rule in RULES}


def _modules() -> list[Any]:
    return [m for name, m in list(sys.modules.items()) if name.startswith(HOME)]


@contextmanager
def replaced(
    rule: Rule, wrap: Callable[[Callable[..., Any]], Callable[..., Any]]
) -> Iterator[None]:
    """Within this block, every place that calls the rule's function calls `wrap(function)`."""
    module, _, path = rule.at.partition(":")
    owner = import_module(HOME + module)
    *classes, last = path.split(".")
    for name in classes:
        owner = getattr(owner, name)
    original = getattr(owner, last)
    new = wrap(original)
    with ExitStack() as stack:
        if classes:
            stack.enter_context(patch.object(owner, last, new))
        for place in () if classes else _modules():
            own = not rule.only or place.__name__ == HOME + rule.only
            if own and place.__dict__.get(last) is original:
                stack.enter_context(patch.object(place, last, new))
        yield


@contextmanager
def without(rule: Rule) -> Iterator[None]:
    """Within this block the rule does nothing."""
    if rule.values is None:
        assert rule.off is not None
        off = rule.off
        with replaced(rule, lambda original: lambda *a, **k: off(*a, **k)):
            yield
        return
    module, _, name = rule.at.partition(":")
    place = import_module(HOME + module)
    found = getattr(place, name)
    with patch.multiple(found if isinstance(found, type) else place, **rule.values):
        yield


@contextmanager
def watched(acted: set[str]) -> Iterator[None]:
    """Within this block names of rules that did something join `acted`."""

    def watch(rule: Rule) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
        def wrap(original: Callable[..., Any]) -> Callable[..., Any]:
            def call(*args: Any, **kwargs: Any) -> Any:
                result = original(*args, **kwargs)
                if rule.name not in acted:
                    told = rule.acts or (lambda r, *a, **k: r != rule.off(*a, **k))  # type: ignore[misc]
                    if told(result, *args, **kwargs):
                        acted.add(rule.name)
                return result

            return call

        return wrap

    with ExitStack() as stack:
        for rule in RULES:
            if rule.values is None:
                stack.enter_context(replaced(rule, watch(rule)))
            else:
                acted.add(rule.name)
        yield


LEARNING = (
    "recolour",
    "drifting",
    "relinearise",
    "rebuilt",
    "with_noise_of",
    "coarser",
    "in_detail",
)
PREDICTING = ("residual", "residuals", "jacobian")
WITHIN = {"spikes"}  # rules within what problems learn, which is then remembered by itself


def _key(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.shape, value.tobytes()
    if hasattr(value, "items"):
        return tuple(sorted(value.items()))
    if isinstance(value, (list, tuple)):
        return tuple(map(_key, value))
    return value if isinstance(value, (str, int, float, bool, type(None))) else id(value)


@contextmanager
def remembered() -> Iterator[list[str]]:
    """Within this block problems remember what they predicted and learnt; what they learnt, apart
    for each content of the list."""
    known: dict[Any, Any] = {}
    apart: list[str] = []
    alive: list[Any] = []

    def remember(name: str, original: Callable[..., Any]) -> Callable[..., Any]:
        def call(self: Any, *args: Any, **kwargs: Any) -> Any:
            given = [list(a) if hasattr(a, "__next__") else a for a in args]
            learns = name.rpartition(".")[2] in LEARNING
            key = id(self), name, _key(given), _key(kwargs), tuple(apart if learns else ())
            if key not in known:
                alive.extend([self, *given])
                known[key] = original(self, *given, **kwargs)
            found = known[key]
            return found.copy() if isinstance(found, np.ndarray) else found

        return call

    def of_one_log(self: BenchProblem, theta: Any, index: int) -> Any:
        """Readings of one log: how other logs begin does not matter."""
        log = self.logs[index]
        told = ((n, v) for n, v in theta.items() if self.starts.get(n, (index,))[0] == index)
        key = id(log), self.predictor.exact, tuple(sorted(told))
        if key not in known:
            alive.append(log)
            known[key] = predict(self, theta, index)
        return known[key]

    predict = BenchProblem.readings
    with ExitStack() as stack:
        stack.enter_context(patch.object(BenchProblem, "readings", of_one_log))
        stack.enter_context(patch("kemba.identify.discover.joint_fit", unjudged))
        for cls in (BenchProblem, RobotProblem):
            for name in (*LEARNING, *PREDICTING):
                new = remember(f"{cls.__name__}.{name}", getattr(cls, name))
                stack.enter_context(patch.object(cls, name, new))
        yield apart


def unjudged(problem: Any, hypothesis: Any, theta: Any) -> JointFit:
    """A joint fit without its costs: intervals of the written model decide no verdict."""
    names, values = [], []
    for effect in hypothesis:
        candidate = problem.candidates[effect]
        for key, p in candidate.keys().items():
            name = candidate.reciprocal.get(p.name, (p.name, ""))[0]
            names.append(f"{effect}.{name}")
            values.append(theta.get(key, p.off))
    names += problem.own_figures
    values += [theta.get(name, 1.0) for name in problem.own_figures]
    x = np.array(values)
    return JointFit(dict(theta), tuple(names), x, x, x, np.zeros((len(x), len(x))))


def answered(problem: Any, setting: Record, truth: Any) -> Record:
    """What is said of one case, in short."""
    started = time.process_time()
    try:
        answer = discover(problem).answer.json()
    except Exception:
        traceback.print_exc()
        return {"failed": True}
    record = {"case": setting, "truth": truth, "answer": answer}
    return in_short(record, time.process_time() - started)


def in_short(record: Record, seconds: float) -> Record:
    """What a record of a blind study says of its case."""
    answer = record["answer"]
    nothing, outside = not hidden(record), kind(record) == "outside"
    first = report.among_first(record, 1)
    if nothing or outside:
        first = answer["verdict"] == ("nothing" if nothing else "unknown")
    return {
        "kind": kind(record),
        "hidden": hidden(record),
        "verdict": answer["verdict"],
        "named": named(record),
        "first": bool(first),
        "exact": bool(report.right(record)),
        "alarm": bool(nothing and answer["verdict"] != "nothing"),
        "sure_wrong": bool(report.sure_and_wrong(record)),
        "p": answer["p_value_nothing"],
        "errors": [answer["error_before"], answer["error_after"]],
        "seconds": round(seconds, 1),
    }


def beside_recorded(study: str, index: int, setting: Record, out: Path) -> None:
    """One case as it is, beside the recorded answer of the same case, where there is one."""
    if any((r["study"], r["index"]) == (study, index) for r in report.read(out)):
        return
    known = report.read(ROOT / "benchmarks" / "blind" / f"{study}.jsonl")
    old = next((r for r in known if r.get("case") == setting and "left_out" not in r), None)
    if old is None:
        return
    truth, make = STUDIES[study].prepared(setting)
    problem = make()
    with remembered():
        new = answered(problem, setting, truth)
    told = {"": {**in_short(old, old["seconds"]), "acted": []}, GONE: new}
    for name, found in told.items():
        report.append(out, {"study": study, "index": index, "without": name, **found})
        print(f"{study} {index} {name or 'recorded'}: {found.get('verdict')}", flush=True)


def run(study: str, index: int, setting: Record, groups: list[str], out: Path) -> None:
    """One case as it is, and without each of the `groups` of rules (none: each rule that acted)."""
    done = {(r["study"], r["index"], r["without"]) for r in report.read(out)}
    wanted = [g for g in groups if (study, index, g) not in done]
    if (study, index, "end") in done and not wanted:
        return
    try:
        truth, make = STUDIES[study].prepared(setting)
        problem = make()
    except Exception as error:
        print(f"left out: {study} {index}: {error}", flush=True)
        return

    def keep(name: str, found: Record) -> None:
        report.append(out, {"study": study, "index": index, "without": name, **found})
        said = " + ".join(found.get("named", ())) or found.get("verdict", "failed")
        print(f"{study} {index} without {name or 'nothing'}: {said}", flush=True)

    with remembered() as apart:
        acted: set[str] = set()
        if (study, index, "") not in done or not groups:
            with watched(acted):
                first = answered(problem, setting, truth)
            if (study, index, "") not in done:
                keep("", {**first, "acted": sorted(acted)})
        for name in wanted or [r.name for r in RULES if r.name in acted]:
            if (study, index, name) in done:
                continue
            rules = [one.strip() for one in name.split(",")]
            apart[:] = sorted(WITHIN & set(rules))
            with ExitStack() as stack:
                for one in rules:
                    stack.enter_context(without(BY_NAME[one]))
                keep(name, answered(problem, setting, truth))
    if not groups:
        report.append(out, {"study": study, "index": index, "without": "end"})


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--study", choices=STUDIES, default="bench")
    parser.add_argument("--cases", default="40", help="so many of the beginning, or begin:end")
    parser.add_argument("--without", action="append", default=[], help="rules, by commas")
    parser.add_argument("--recorded", action="store_true", help="beside the recorded answers")
    parser.add_argument("--seconds", type=float, help="length of bench logs, other than recorded")
    parser.add_argument("--out", type=Path, default=RECORDS)
    parser.add_argument("--report", action="store_true", help="run nothing, only tell the results")
    parser.add_argument(
        "--write", action="store_true", help="put the table into benchmarks/pages/tried.md"
    )
    options = parser.parse_args()
    if not options.report:
        begin, _, end = options.cases.rpartition(":")
        cases = list(enumerate(STUDIES[options.study].cases()))[int(begin or 0) : int(end)]
        for index, setting in cases:
            if options.seconds and "duration" in setting:
                setting["duration"] = options.seconds
            if options.recorded:
                beside_recorded(options.study, index, setting, options.out)
            else:
                run(options.study, index, setting, options.without, options.out)
    found = table(report.read(options.out))
    print(found)
    if options.write:
        write(ROOT / "benchmarks" / "pages" / "tried.md", found)


if __name__ == "__main__":
    main()
