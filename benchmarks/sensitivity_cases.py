"""Cases of the sensitivity study: stages that are run again from where a setting is read.

What is slow and pure (residuals, slopes, new linearisations) is remembered while a case runs with
all settings as they are, and taken from memory where the settings that it reads are the same.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from sensitivity_page import Change

from kemba.settings import Settings, changed

MORE = 5  # times the usual iterations, after which a plan counts as not found
UNHURRIED = ["solver.time_limit=3600"]  # a busy machine must not decide
PURE = ("residual", "jacobian", "leftover", "relinearise", "recolour")
Stages = Sequence[tuple[str, Callable[[Any], Any]]]
Values = dict[type[Settings], Settings]


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

    def __init__(self, name: str, stages: Stages, memory: Memory | None = None) -> None:
        self.name, self.stages, self.memory = name, stages, memory or Memory()
        self.states: list[Any] = [None]
        self.reads: list[set[type[Settings]]] = []

    def base(self) -> Any:
        """The answer with all settings as they are."""
        for _, stage in self.stages:
            with recorded() as seen:
                self.states.append(stage(kept(self.states[-1])))
            self.reads.append(seen)
        self.memory.learning = False
        return self.states[-1]

    def answer(self, change: Change) -> Any | None:
        """The answer with one setting changed; None where no stage reads it.

        A stage that hands on the very same object as before has not changed anything.
        """
        reading = [i for i, seen in enumerate(self.reads) if change.cls in seen]
        if not reading:
            return None
        with changed(change.cls, **{change.field: change.value}):
            for first in reading:
                state = self._stage(first, self.states[first])
                if state is not self.states[first + 1]:
                    break
            else:
                return self.states[-1]
            for i in range(first + 1, len(self.stages)):
                state = self._stage(i, state)
        return state

    def _stage(self, i: int, state: Any) -> Any:
        return self.stages[i][1](kept(state))


def kept(state: Any) -> Any:
    """A copy that later stages may change. Problems do not change, and are not copied."""
    if not isinstance(state, tuple):
        return state
    search = state[0]
    shared = (search.problem, search.base.problem, search.base.division.problem)
    return copy.deepcopy(state, {id(p): p for p in shared})


class Memory:
    """Answers of pure functions, each with the settings that were read for it."""

    def __init__(self) -> None:
        self.learning = True
        self._answers: dict[Any, list[tuple[Values, Any]]] = {}
        self._alive: dict[int, Any] = {}  # so that no other object gets the same id

    def remembered(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function, called again only where the settings that it reads have changed."""

        @wraps(function)
        def call(*args: Any, **more: Any) -> Any:
            key = (function, *(self._key(a) for a in args), self._key(more))
            for values, answer in self._answers.get(key, ()):
                if all(cls.current() == value for cls, value in values.items()):
                    return answer.copy() if isinstance(answer, np.ndarray) else answer
            with recorded() as seen:
                answer = function(*args, **more)
            if self.learning:
                stored = answer.copy() if isinstance(answer, np.ndarray) else answer
                values = {cls: cls.current() for cls in seen}
                self._answers.setdefault(key, []).append((values, stored))
            return answer

        return call

    @contextmanager
    def on(self, cls: type[Any], names: Sequence[str]) -> Iterator[None]:
        """Methods of a class that remember, within this block."""
        methods = {name: self.remembered(getattr(cls, name)) for name in names}
        with patch.multiple(cls, **methods):
            yield

    def _key(self, value: Any) -> Any:
        """A value as part of a key; other objects by what they are."""
        if isinstance(value, Mapping):
            return tuple(sorted((k, self._key(v)) for k, v in value.items()))
        if isinstance(value, np.ndarray):
            return value.shape, value.tobytes()
        if isinstance(value, list | tuple | set | frozenset):
            return tuple(value)
        if isinstance(value, str | int | float | bool) or value is None:
            return value
        self._alive[id(value)] = value
        return id(value)


def discovery(name: str, kind: str, setting: dict[str, Any], folder: Path) -> Case:
    """A case of a blind study: gate, problem, checks, search, answer."""
    from blind import bench, robot

    from kemba.identify.bench.problem import BenchProblem, bench_problem
    from kemba.identify.compare.compare import compare
    from kemba.identify.discover import judged
    from kemba.identify.evidence.search import Search
    from kemba.identify.logs.gate import BadData, check_logs
    from kemba.identify.logs.reading import read_logs
    from kemba.identify.robot.problem import RobotProblem, robot_problem
    from kemba.model.spec import load_model

    paths = (bench if kind == "bench" else robot).logs_of(setting, folder)[0]
    logs = read_logs(paths)
    memory = Memory()

    def checked(_: Any) -> Any:
        try:
            check_logs(logs)
        except BadData:
            return None
        return logs

    def problem(good: Any) -> Any:
        if good is None:
            return None
        if kind == "bench":
            model = load_model(bench.MODELS[setting["chambers"]], rig=True)
            return bench_problem(logs, model)
        return robot_problem(logs, load_model())

    def validated(found: Any) -> Any:
        try:
            if found is not None:
                found.validate()
        except BadData:
            return None
        return found

    def searched(found: Any) -> Any:
        if found is None:
            return None
        search = Search(found)
        with memory.on(BenchProblem, PURE), memory.on(RobotProblem, PURE):
            return search, search.run()

    def answered(state: Any) -> dict[str, Any]:
        if state is None:
            return {"verdict": "bad-data", "added": [], "same": []}
        with memory.on(BenchProblem, PURE), memory.on(RobotProblem, PURE):
            answer = judged(*state).answer
        rows = [r for r in answer.ranking if r.effect in answer.added]
        same = sorted({other for r in rows for other in r.equivalent_to})
        return {"verdict": answer.verdict, "added": sorted(answer.added), "same": same}

    def compared(found: Any) -> dict[str, Any]:
        if found is None:
            return {"verdict": "bad-data", "hints": []}
        with memory.on(BenchProblem, PURE), memory.on(RobotProblem, PURE):
            done = compare(found, "model")
        kinds = sorted({hint.kind for hint in done.hints})
        grade = "good" if done.good else "tolerable" if done.tolerable else "bad"
        return {"verdict": grade, "hints": kinds}

    begin = [("gate", checked), ("problem", problem), ("checks", validated)]
    if name.startswith("compare"):
        return Case(name, [*begin, ("compare", compared)], memory)
    return Case(name, [*begin, ("search", searched), ("answer", answered)], memory)


def planning(name: str) -> Case:
    """A shipped task, planned: checks, search for a plan, refinement."""
    from kemba.ocp import load_task
    from kemba.ocp.certificate.status import Status
    from kemba.ocp.infeasibility.checks import check_task
    from kemba.ocp.infeasibility.explain import refusal
    from kemba.ocp.nlp.ipopt import Control
    from kemba.ocp.planner import Planner, searched
    from kemba.ocp.reading import task_model
    from kemba.ocp.refined import refined
    from kemba.ocp.relaxation.session import Session
    from kemba.ocp.task.resolve import resolve

    task, document = load_task(f"{name.removeprefix('schedule:')}.yaml", UNHURRIED)
    model = task_model(task)
    requirements = resolve(task, model, document)
    done: dict[str, int] = {}  # iterations of every stage with all settings as they are
    verdicts = {True: "refused", False: "planned"}  # the same objects every time

    def planner(stage: str) -> Planner:
        """A planner that gives up after `MORE` times the usual iterations of this stage."""
        left = [MORE * done.get(stage, 10**9)]

        def stop() -> bool:
            left[0] -= 1
            return left[0] < 0

        return Planner(task, model, requirements, Session(Control(stop=stop)))

    def checked(_: Any) -> str:
        diagnostics = check_task(task, model, requirements, document)
        return verdicts[refusal(diagnostics) is not None]

    def found(verdict: str) -> Any:
        plan = searched(planner("search"), verdict == "refused")
        done.setdefault("search", plan.iterations)
        return [plan]

    def finished(plans: Any) -> dict[str, Any]:
        (plan,) = plans
        if plan.status is Status.SOLVED:
            before = plan.iterations
            plan = refined(planner("refine"), plan)
            done.setdefault("refine", plan.iterations)
            total = before + plan.iterations
        else:
            total = plan.iterations
        return {
            "verdict": str(plan.status),
            "cost": float(sum(plan.cost.values())),
            "iterations": int(total),
        }

    return Case(name, [("check", checked), ("search", found), ("refine", finished)])
