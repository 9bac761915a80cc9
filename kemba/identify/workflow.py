"""From files to an answer folder: read, check, search, write."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from kemba.errors import KembaError
from kemba.files import write_json
from kemba.identify.adopt import reference, write_model
from kemba.identify.answer import Answer
from kemba.identify.discover import Discovery, discover
from kemba.identify.logs.excerpt import excerpts
from kemba.identify.logs.gate import BadData, check_logs, sentence
from kemba.identify.logs.limits import limits_of
from kemba.identify.logs.reading import read_logs, taken_on
from kemba.identify.problem.problem import Problem
from kemba.logs import load_map
from kemba.model import Model, load_model
from kemba.trajectory import Trajectory

Paths = Sequence[str | Path]


def discover_logs(
    logs: Paths,
    holdout: Paths = (),
    model: str = "planning",
    column_map: str | Path | None = None,
    time_limit: float = 300.0,
    say: Callable[[str], None] = lambda text: None,
    out: str | Path | None = None,
) -> tuple[Answer, Discovery | None]:
    """Answer which effect `model` lacks; written to the folder `out` when one is given.

    Data that cannot be right give the verdict `bad-data`, and nothing is fitted. Raises
    KembaError for files that cannot be read.
    """
    started = time.monotonic()
    columns = load_map(column_map) if column_map else None
    say("reading the logs")
    fitted, kept = read_logs(logs, columns), read_logs(holdout, columns) if holdout else []
    found: Discovery | None = None
    try:
        _apart(fitted, kept)
        built = model_of(fitted, model)
        checked = [*check_all([*fitted, *kept], built), *limits_of(fitted)]
        say("finding the motion in the logs")
        problem, remarks = admitted(fitted, built)
        remarks = [*built.remarks, *checked, *remarks]
        judge = make_problem(excerpts(kept)[0], built) if kept else None
        left = time_limit - (time.monotonic() - started)
        found = discover(problem, judge, left, say)
        answer = found.answer
        answer.remarks = [*answer.remarks, *remarks]
    except BadData as error:
        answer = Answer("bad-data", sentence=sentence(error.errors))
        answer.remarks = [str(e) for e in error.errors]
    answer.runtime_s = time.monotonic() - started
    if out is not None:
        write_answer(answer, Path(out), model)
    return answer, found


def model_of(logs: Sequence[Trajectory], name: str) -> Model:
    """The model `name` of the robot, or for bench logs of one of its pistons."""
    return load_model(name, rig=logs[0].meta["kind"] == "bench")


def check_all(logs: Sequence[Trajectory], model: Model) -> list[str]:
    """Remarks on logs that were taken on the machine of `model`, each looked at by itself.

    Raises BadData with every fault.
    """
    taken_on(logs, model.mechanism)
    return check_logs(logs)


def admitted(logs: Sequence[Trajectory], model: Model) -> tuple[Problem, list[str]]:
    """The problem that logs pose, shortened where they are long, and remarks.

    Raises BadData where they contradict themselves or any model. Together with `check_all` this
    is the gate of `check`, `compare` and `discover`.
    """
    shortened, cut = excerpts(logs)
    problem = make_problem(shortened, model)
    return problem, [*cut, *problem.validate()]


def check_log(
    path: str | Path, model: str = "planning", column_map: str | Path | None = None
) -> tuple[Trajectory, list[str]]:
    """A log that `compare` and `discover` will accept, and remarks on it.

    Raises KembaError where the file cannot be read; BadData where the log cannot be right.
    """
    logs = read_logs([path], load_map(column_map) if column_map else None)
    built = model_of(logs, model)
    remarks = [*built.remarks, *check_all(logs, built)]
    return logs[0], [*remarks, *admitted(logs, built)[1]]


def make_problem(logs: Sequence[Trajectory], model: Model) -> Problem:
    """The problem of explaining bench or robot logs with a model."""
    if logs[0].meta["kind"] == "bench":
        from kemba.identify.bench.problem import bench_problem

        return bench_problem(logs, model)
    if model.mechanism.rig == "vessel":
        from kemba.identify.rigs.vessel import vessel_problem

        return vessel_problem(logs, model)
    if model.mechanism.rig:
        from kemba.identify.rigs.problem import rig_problem

        return rig_problem(logs, model)
    from kemba.identify.robot.problem import robot_problem

    return robot_problem(logs, model)


def write_answer(answer: Answer, out: Path, model: str) -> None:
    """answer.json, and the model with what was found."""
    out.mkdir(parents=True, exist_ok=True)
    data: dict[str, Any] = answer.json()
    for stale in ("model.yaml", "answer.json"):
        (out / stale).unlink(missing_ok=True)
    if answer.added:
        path = write_model(out / "model.yaml", model, data["ranking"], answer.added)
        answer.model = data["model"] = str(path)
    write_json(out / "answer.json", data | {"base": reference(model)})


def _apart(fitted: Sequence[Trajectory], kept: Sequence[Trajectory]) -> None:
    """A held-out log must not be fitted as well."""
    both = {Path(t.meta["path"]).resolve() for t in fitted} & {
        Path(t.meta["path"]).resolve() for t in kept
    }
    if both:
        raise KembaError("--holdout", f"{sorted(both)[0].name} is also among the logs to be fitted")
