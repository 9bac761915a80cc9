"""Cases of the sensitivity study: stages that are run again from where a setting is read."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any
from unittest.mock import patch

from sensitivity_page import Change

from kemba.settings import Settings, changed

MORE = 5  # times the usual iterations, after which a plan counts as not found
UNHURRIED = ["solver.time_limit=3600"]  # a busy machine must not decide
Stages = Sequence[tuple[str, Callable[[Any], Any]]]


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
                self.states.append(stage(self.states[-1]))
            self.reads.append(seen)
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
        return self.stages[i][1](state)


def planning(name: str) -> Case:
    """A shipped task, planned: checks, search for a plan, refinement."""
    from kemba.ocp import load_task
    from kemba.ocp.certificate.status import Status
    from kemba.ocp.finer import refined
    from kemba.ocp.infeasibility.checks import check_task
    from kemba.ocp.infeasibility.explain import refusal
    from kemba.ocp.nlp.ipopt import Control
    from kemba.ocp.planner import Planner, searched
    from kemba.ocp.reading import task_model
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
