"""What naturally follows each verb: the one place that knows their order.

Every function gives the words behind `kemba-opt`, empty where nothing follows. `say_next` says
them on stderr, with the options that the next verb needs too.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kemba_cli.common import manner, say

if TYPE_CHECKING:
    from kemba.report.verdict import ReviewVerdict

PLANNING = "planning"
EXECUTED = "--repeat 3 --noise"
LAST = {  # verbs that end the way, and why
    "view": "it is there to be looked at",
    "export": "another program goes on",
    "effects": "it is there to be read",
    "schema": "an editor goes on",
    "sensitivity": "it is there to be read",
}

Log = str | Path


def say_next(words: str) -> None:
    """`next: kemba-opt ...` on stderr, with the user's own effects; nothing for no words."""
    if words:
        say(f"next: kemba-opt {words}{_own()}")


def say_verdict(verdict: ReviewVerdict) -> None:
    """The verdict of a page, what speaks against it, and what to do next."""
    say(verdict.sentence)
    if verdict.doubt:
        say(f"but: {verdict.doubt}", always=True)
    command = verdict.command and f"{verdict.command}{_own()}"
    say(f"next: {verdict.next} {command}".rstrip())


def _own() -> str:
    """The files of the user's own effects, as they are typed."""
    return "".join(f" --effects {shlex.quote(str(file))}" for file in manner.get().effects)


def after_solve(run: str, good: bool, status: str = "") -> str:
    """A good plan is executed; another one is looked at, or continued. So is that of `learn`."""
    if status == "interrupted":
        return f"solve --resume {shlex.quote(run)}"
    return after_plan(run) if good else f"report {shlex.quote(run)}"


def after_plan(run: str) -> str:
    """A plan is executed on the simulated robot, where it costs nothing, with its feedback if it
    has some."""
    from kemba.runs import POLICY

    policy = "--policy " * (Path(run) / POLICY).is_file()
    return f"simulate {shlex.quote(run)} {policy}{EXECUTED}"


def after_simulate(logs: Sequence[Log], run: Path) -> str:
    """Logs of a run are reviewed with it; others are compared with a model."""
    if (run / "certificate.json").is_file():
        return f"review {_typed(logs)} --run {shlex.quote(str(run))}"
    return f"compare {_typed(logs)}"


def after_plot(runs: Sequence[Path]) -> str:
    """A run that was drawn has a page with its verdict."""
    planned = [run for run in runs if (run / "certificate.json").is_file()]
    return f"report {shlex.quote(str(planned[0]))}" if len(planned) == len(runs) == 1 else ""


def after_map(log: Path, column_map: Path, model: str = PLANNING) -> str:
    """A drafted map is tried on its log, with the model of the machine that it was drafted for."""
    return f"check {_typed([log], column_map, model)}"


def after_check(
    answers: Sequence[Mapping[str, Any]], column_map: str | None, model: str = PLANNING
) -> str:
    """Logs are searched for what a model lacks; a task, a sweep or a rig is executed."""
    logs = [answer["file"] for answer in answers if answer["kind"] == "log"]
    if logs:
        return discover(logs, column_map, model)
    follows = {"tasks": "solve {}", "sweeps": "sweep {}", "rigs": "simulate {} --noise"}
    known = [a for a in answers if a["kind"] in follows]
    return follows[known[0]["kind"]].format(shlex.quote(known[0]["file"])) if known else ""


def after_compare(
    logs: Sequence[Log], column_map: str | None, model: str, run: Path | None, explained: bool
) -> str:
    """A model that fails is searched; one that holds is shown on a page."""
    if not explained:
        return discover(logs, column_map, model)
    of_run = f" --run {shlex.quote(str(run))}" if run is not None and run.is_dir() else ""
    return f"review {_typed(logs, column_map, model)}{of_run}"


def discover(logs: Sequence[Log], column_map: str | None, model: str) -> str:
    """The question what a model lacks; its answer goes to a folder that is free."""
    return f"discover {_typed(logs, column_map, model)}"


def after_discover(logs: Sequence[Log], column_map: str | None, model: str, answer: Path) -> str:
    """An answer is read on a page."""
    return f"review {_typed(logs, column_map, model)} --answer {shlex.quote(str(answer))}"


def after_model(
    model: Path, rig: bool = False, logs: Sequence[Log] = (), column_map: Log | None = None
) -> str:
    """A model of the robot is planned with; that of a rig is compared with its logs."""
    if rig:
        return f"compare {_typed(logs, column_map, str(model))}" if logs else ""
    return f"solve jump.yaml --model {shlex.quote(str(model))}"


def after_experiment(file: Path | str, is_task: bool) -> str:
    """A test is tried in simulation: a rig at once, a motion when it is planned."""
    named = shlex.quote(str(file))
    return f"solve {named}" if is_task else f"simulate {named} --noise"


def after_sweep(file: str, folder: Path, finished: bool) -> str:
    """A sweep that was stopped is continued by the same command."""
    return "" if finished else f"sweep {shlex.quote(file)} --out {shlex.quote(str(folder))}"


def _typed(logs: Sequence[Log], column_map: Log | None = None, model: str | None = None) -> str:
    """Logs and their options as they are typed; the planning model needs no option."""
    from kemba.folders import typed

    return typed(logs, column_map, None if model == PLANNING else model)
