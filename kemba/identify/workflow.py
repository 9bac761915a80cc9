"""From files to an answer folder: read, check, search, write."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from kemba.errors import KembaError, enumerated
from kemba.files import sha256, write_json
from kemba.identify.answer import Answer
from kemba.identify.discover import Discovery, discover
from kemba.identify.logs.excerpt import excerpts
from kemba.identify.logs.gate import BadData, check_logs, sentence
from kemba.identify.logs.limits import limits_of
from kemba.identify.logs.reading import read_logs, taken_on
from kemba.identify.problem.problem import Problem
from kemba.identify.written.adopt import COVARIANCE, reference, write_model
from kemba.identify.written.quoted import measured_in, noise_ratio, plant_of
from kemba.logs import load_map
from kemba.model import Model, load_model, load_spec
from kemba.model.spec import evidence_faults
from kemba.scene import scene_in
from kemba.trajectory import Trajectory

Paths = Sequence[str | Path]
QUOTED = 3  # of so many logs one is kept aside for the error that is quoted, where none are given


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

    The errors that it tells are those of `compare` with the model that is written, on the logs of
    `holdout`; where there are none, on logs that are kept aside. Data that cannot be right give the
    verdict `bad-data`, and nothing is fitted. Raises KembaError for files that cannot be read.
    """
    started = time.monotonic()
    columns = load_map(column_map) if column_map else None
    say("reading the logs")
    fitted, kept = read_logs(logs, columns), read_logs(holdout, columns) if holdout else []
    found: Discovery | None = None
    try:
        _apart(fitted, kept)
        fitted, kept, said = _kept_aside(fitted, kept)
        built = model_of(fitted, model)
        checked = [*check_all([*fitted, *kept], built), *limits_of(fitted)]
        say("finding the motion in the logs")
        problem, remarks = admitted(fitted, built)
        remarks = [*said, *evidence_faults(model), *built.remarks, *checked, *remarks]
        judge = make_problem(excerpts(kept)[0], built) if kept else None
        left = time_limit - (time.monotonic() - started)
        found = discover(problem, judge, left, say)
        answer = found.answer
        say("comparing what is written with the quoted logs")
        _quote(answer, judge or problem, kept or fitted, model)
        answer.remarks = [*answer.remarks, *remarks]
        answer.evidence = _evidence(answer, fitted, kept, model)
    except BadData as error:
        answer = Answer("bad-data", sentence=sentence(error.errors))
        answer.remarks = [str(e) for e in error.errors]
    answer.runtime_s = time.monotonic() - started
    if out is not None:
        write_answer(answer, Path(out), model)
    return answer, found


def _kept_aside(
    fitted: Sequence[Trajectory], kept: Sequence[Trajectory]
) -> tuple[list[Trajectory], list[Trajectory], list[str]]:
    """Logs to learn from, logs to quote, and a remark where none were given for that."""
    count = 0 if kept else len(fitted) // QUOTED
    if count:
        learnt, quoted = list(fitted[:-count]), list(fitted[-count:])
        names = enumerated([str(log.meta["name"]) for log in quoted])
        return learnt, quoted, [f"kept aside for the quoted error: {names}"]
    few = "of data that the fit has seen: with three logs or more, one is kept aside"
    return list(fitted), list(kept), [] if kept else [f"the quoted error is {few}"]


def _quote(answer: Answer, judge: Problem, logs: Sequence[Trajectory], model: str) -> None:
    """Tell the errors on quoted logs as `compare` does, of the model as it is (`judge`), and of
    the one that is written; what does not predict better there is not written."""
    before = answer.error_before, answer.error_after
    evidence = load_spec(model).evidence
    stated = noise_ratio(judge, evidence.figures if evidence else {})
    answer.error_before = answer.error_after = stated
    if answer.writes:
        with tempfile.TemporaryDirectory() as folder:
            data = answer.json()
            file = Path(folder) / "model.yaml"
            write_model(file, model, data["ranking"], answer.added, data)
            written = make_problem(excerpts(logs)[0], model_of(logs, str(file)))
        answer.error_after = noise_ratio(written, answer.machine)
        if answer.error_after > answer.error_before:
            answer.drop_model()
    answer.told_in(before)


def _evidence(
    answer: Answer, fitted: Sequence[Trajectory], kept: Sequence[Trajectory], model: str
) -> dict[str, Any] | None:
    """What the model that is written rests on, as its YAML says it; None where none is written."""
    if not answer.writes:
        return None
    used = [*((log, "learnt") for log in fitted), *((log, "quoted") for log in kept)]
    paths = [(Path(log.meta["path"]).resolve(), use) for log, use in used]
    quoted, plant = kept or fitted, None
    if quoted[0].meta["kind"] == "robot":
        simulated = plant_of(model, scene_in(quoted[0].meta))
        plant = noise_ratio(make_problem(excerpts(quoted)[0], simulated))
    return {
        "logs": [{"file": str(p), "sha256": sha256(p), "use": use} for p, use in paths],
        "error_before": answer.error_before,
        "error_held_out": answer.error_after,
        "error_plant": plant,
        "figures": {name: float(f"{x:.6g}") for name, x in answer.machine.items()},
        "measured": measured_in([*fitted, *kept], model).model_dump(exclude_none=True),
    }


def model_of(logs: Sequence[Trajectory], name: str) -> Model:
    """The model `name` of the robot in the scene of the logs, or for bench logs of one of its
    pistons. Raises KembaError where logs were taken in several scenes."""
    scenes = [scene_in(log.meta, str(log.meta.get("name", ""))) for log in logs]
    if any(scene != scenes[0] for scene in scenes):
        names = ", ".join(str(log.meta.get("name")) for log in logs)
        hint = "look at the logs of each scene by themselves"
        raise KembaError(names, "were taken on different terrain", hint=hint)
    return load_model(name, rig=logs[0].meta["kind"] == "bench", scene=scenes[0])


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
    for stale in ("model.yaml", COVARIANCE, "answer.json"):
        (out / stale).unlink(missing_ok=True)
    if answer.writes:
        path = write_model(out / "model.yaml", model, data["ranking"], answer.added, data)
        answer.model = data["model"] = str(path)
    write_json(out / "answer.json", data | {"base": reference(model)})


def _apart(fitted: Sequence[Trajectory], kept: Sequence[Trajectory]) -> None:
    """A held-out log must not be fitted as well."""
    both = {Path(t.meta["path"]).resolve() for t in fitted} & {
        Path(t.meta["path"]).resolve() for t in kept
    }
    if both:
        raise KembaError("--holdout", f"{sorted(both)[0].name} is also among the logs to be fitted")
