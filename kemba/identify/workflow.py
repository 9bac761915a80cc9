"""From files to an answer folder: read, check, search, write."""

import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from kemba.errors import KembaError, enumerated
from kemba.files import sha256, write_json
from kemba.identify.adopt import COVARIANCE, reference, write_model
from kemba.identify.answer import Answer, VerdictSettings, phrase
from kemba.identify.compare.compare import Comparison, compare
from kemba.identify.discover import Discovery, discover
from kemba.identify.infer.null_model import with_learnt_colour
from kemba.identify.infer.verdict import rest_of
from kemba.identify.infer.windows import error_ratio, free_starts
from kemba.identify.logs.gate import BadData, check_logs, limits_of, sentence
from kemba.identify.logs.reading import excerpts, read_logs, taken_on
from kemba.identify.problem.problem import Array, Problem
from kemba.mechanism.robot_file import robot_files
from kemba.model import Model, build_model, load_model, load_spec
from kemba.model.evidence import Measured
from kemba.model.spec import evidence_faults
from kemba.scene import Scene, scene_in
from kemba.stopwatch import Tell, silent
from kemba.trajectory import Trajectory

PLANT = "plant"  # the shipped simulated robot, with physical chambers
AROUND = 0.01  # s before and after a reading from which a speed is told


def _with_noise(problem: Problem) -> Problem:
    """The problem with the noise of its logs, as `compare` learns it."""
    return with_learnt_colour(problem, free_starts(problem))


def _figures_felt(problem: Problem, figures: Mapping[str, float]) -> dict[str, float]:
    """Those figures of a machine that these logs can feel; the others are nominal."""
    return {name: value for name, value in figures.items() if name in problem.nuisance}


def plant_of(model: str | Path, scene: Scene) -> Model:
    """The shipped plant on the robot of `model` in a scene."""
    robot = load_spec(model).robot
    return build_model(load_spec(PLANT).model_copy(update={"robot": robot}), scene=scene)


def _measured_in(logs: Sequence[Trajectory], model: str | Path) -> Measured:
    """What logs span of heights, speeds, supply pressures and valve modes."""
    spec, body = load_spec(model), [log for log in logs if "body/z" in log]
    apex = [float(np.nanmax(log["body/z"])) for log in body]
    speed = [float(np.nanmax(_speed(log))) for log in body]
    supply = (spec.supply, spec.supply) if spec.supply else None
    modes: set[str] = set()  # of a leg's valves: extend, then retract
    for log in logs:
        for name in log.names:
            leg, extend, _ = name.rpartition("valve/extend")
            if extend and f"{leg}valve/retract" in log:
                pair = np.stack([log[name], log[f"{leg}valve/retract"]])
                both = np.unique(pair[:, np.isfinite(pair).all(axis=0)], axis=1)
                modes |= {f"{on:.0f}{back:.0f}" for on, back in both.T}
    robot = sha256(robot_files(spec.robot)[0]) if spec.robot else None
    spans = [(min(x), max(x)) if x else None for x in (apex, speed)]
    load = sum(e.value("m") for e in spec.effects if e.kind == "payload")
    known: dict[str, Any] = {"modes": tuple(sorted(modes)), "robot": robot, "payload": load}
    return Measured(apex=spans[0], speed=spans[1], supply=supply, **known)


def _speed(log: Trajectory) -> Array:
    """Speed [m/s] of the body (n,), from places some time apart."""
    before, after = log.time - AROUND, log.time + AROUND
    inside = (before >= log.time[0]) & (after <= log.time[-1])
    steps = [
        np.interp(after, log.time, log[n]) - np.interp(before, log.time, log[n])
        for n in ("body/x", "body/z")
    ]
    return np.where(inside, np.hypot(*steps) / (2.0 * AROUND), 0.0)


Paths = Sequence[str | Path]
# what the end of an answer and its first fit take, in units of what comes before them (with three
# logs of the shipped jump 20 s and 7 s after 5 s), and the drawing of its figures [s]
ENDS, BEGINS, DRAWN = 4.0, 1.3, 5.0
QUOTED = 3  # of so many logs one is kept aside for the error that is quoted, where none are given


def discover_logs(
    logs: Paths,
    holdout: Paths = (),
    model: str = "planning",
    column_map: str | Path | None = None,
    time_limit: float = 300.0,
    say: Tell = silent,
    out: str | Path | None = None,
    share: float = 1.0,
) -> tuple[Answer, Discovery | None]:
    """Answer which effect `model` lacks; written to the folder `out` when one is given.

    The errors that it tells are those of `compare` with the model that is written, on the logs of
    `holdout`; where there are none, on logs that are kept aside. Data that cannot be right give the
    verdict `bad-data`, and nothing is fitted. `share` of the `time_limit` [s] is for this. Raises
    KembaError for files that cannot be read, and for a limit in which logs cannot be answered.
    """
    started = time.monotonic()
    say("reading the logs")
    fitted, kept = read_logs(logs, column_map), read_logs(holdout, column_map) if holdout else []
    found: Discovery | None = None
    try:
        paths = ({Path(log.meta["path"]).resolve() for log in some} for some in (fitted, kept))
        if both := set.intersection(*paths):
            what = f"{sorted(both)[0].name} is also among the logs to be fitted"
            raise KembaError("--holdout", what)
        fitted, kept, said = _kept_aside(fitted, kept)
        built = model_of(fitted, model)
        checked = check_all([*fitted, *kept], built)
        say("finding the motion in the logs")
        problem, remarks = admitted(fitted, built)
        remarks = [*said, *evidence_faults(model), *built.remarks, *checked, *remarks]
        judge = make_problem(excerpts(kept)[0], built) if kept else None
        left = _searching(time_limit, time.monotonic() - started, share)
        found = discover(problem, judge, left, say)
        answer = found.answer
        say("comparing what is written with the quoted logs")
        quoted = _quote(answer, judge or problem, kept or fitted, model)
        _hold_against(found)
        answer.remarks = [*answer.remarks, *remarks]
        answer.evidence = _evidence(answer, quoted, fitted, kept, model)
    except BadData as error:
        answer = Answer("bad-data", sentence=sentence(error.errors))
        answer.remarks = [str(e) for e in error.errors]
    answer.runtime_s = time.monotonic() - started
    if out is not None:
        write_answer(answer, Path(out), model)
    return answer, found


def _searching(limit: float, begun: float, share: float = 1.0) -> float:
    """The time [s] for the search of an answer that may take its `share` of `limit`, after `begun`.
    Raises KembaError where there is none."""
    left = share * limit - begun - ENDS * begun - DRAWN
    if left < 0.0:
        need = ((1.0 + BEGINS + ENDS) * begun + DRAWN) / share
        what = f"{limit:g} s are too short for these logs, of which nothing was fitted"
        raise KembaError("time limit", what, f"about {need:.0f} s are needed on this machine")
    return left


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


def _quote(answer: Answer, judge: Problem, logs: Sequence[Trajectory], model: str) -> Problem:
    """Tell errors as `compare` does; drop a model that is no better. The better one's problem."""
    before = answer.error_before, answer.error_after
    evidence, judge = load_spec(model).evidence, _with_noise(judge)
    stated = error_ratio(judge, _figures_felt(judge, evidence.figures if evidence else {}))
    answer.error_before = answer.error_after = stated
    if answer.writes:
        with tempfile.TemporaryDirectory() as folder:
            file = write_model(Path(folder) / "model.yaml", model, answer.json())
            written = make_problem(excerpts(logs)[0], model_of(logs, str(file)))
        written = _with_noise(written)
        answer.error_after = error_ratio(written, _figures_felt(written, answer.machine))
        if answer.error_after > answer.error_before:
            answer.drop_model()
        else:
            judge = written
    answer.rescaled_from(before)
    return judge


def _hold_against(found: Discovery) -> None:
    """Take back a verdict that the quoted error contradicts: the noise that the search has learnt
    may forget what changes slowly."""
    answer, settings = found.answer, VerdictSettings
    before, after = answer.error_before, answer.error_after
    leaves = f"leaves an error of {after:.3g} times the noise"
    if answer.verdict == "missing":
        unchanged = round(after, 2) >= round(before, 2)
        if unchanged or not settings.is_whole(before, after):
            stays = f"leaves the quoted error at {after:.3g} times the noise"
            reason = f"the answer {stays if unchanged else leaves}"
            answer.verdict, answer.remarks = "partly", [reason, *answer.remarks]
            answer.rest, answer.next = rest_of(found.search, found.best, ())
    elif answer.verdict == "nothing" and after > settings.plain:
        reason = f"the model as it is {leaves}, and no effect explains enough of it"
        answer.verdict, answer.remarks = "unknown", [reason, *answer.remarks]
    answer.sentence = phrase(answer)


def _evidence(
    answer: Answer,
    judge: Problem,
    fitted: Sequence[Trajectory],
    kept: Sequence[Trajectory],
    model: str,
) -> dict[str, Any] | None:
    """What the written model rests on, as its YAML says it; `judge`: quoted logs under it."""
    if not answer.writes:
        return None
    used = [*((log, "learnt") for log in fitted), *((log, "quoted") for log in kept)]
    paths = [(Path(log.meta["path"]).resolve(), use) for log, use in used]
    quoted, plant = kept or fitted, None
    if quoted[0].meta["kind"] == "robot":
        simulated = plant_of(model, scene_in(quoted[0].meta))
        # one noise for both, or the model that takes more of its error for noise would look better
        other = make_problem(excerpts(quoted)[0], simulated).with_noise_of(judge)
        plant = error_ratio(other, {})
    return {
        "logs": [{"file": str(p), "sha256": sha256(p), "use": use} for p, use in paths],
        "error_before": answer.error_before,
        "error_held_out": answer.error_after,
        "error_plant": plant,
        "figures": {name: float(f"{x:.6g}") for name, x in answer.machine.items()},
        "measured": _measured_in([*fitted, *kept], model).model_dump(exclude_none=True),
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
    return [*check_logs(logs), *limits_of(logs)]


def admitted(logs: Sequence[Trajectory], model: Model) -> tuple[Problem, list[str]]:
    """The problem that logs pose, shortened where they are long, and remarks.

    Raises BadData where they contradict themselves or any model. Together with `check_all` this
    is the gate of `check`, `compare` and `discover`.
    """
    shortened, cut = excerpts(logs)
    problem = make_problem(shortened, model)
    return problem, [*cut, *problem.validate()]


def posed(logs: Sequence[Trajectory], model: str, tell: Tell = silent) -> tuple[Problem, list[str]]:
    """The problem that logs pose to a model, and remarks. Raises KembaError; BadData where the logs
    cannot be right."""
    built = model_of(logs, model)
    remarks = [*built.remarks, *check_all(logs, built)]
    tell("finding the motion in the logs")
    problem, more = admitted(logs, built)
    return problem, [*remarks, *more]


def check_log(
    path: str | Path, model: str = "planning", column_map: str | Path | None = None
) -> tuple[Trajectory, list[str]]:
    """The log at `path`, which `compare` and `discover` will accept, and remarks on it; `model`: of
    its machine; `column_map`: for the log of another program.

    Raises KembaError where the file cannot be read; BadData where the log cannot be right.
    """
    logs = read_logs([path], column_map)
    return logs[0], posed(logs, model)[1]


def make_problem(
    logs: Sequence[Trajectory], model: Model, figures: Mapping[str, float] | None = None
) -> Problem:
    """The problem of explaining logs with a model; of a rig of the user's own `figures` are more
    that may be scaled, with 1 sigma of their factors."""
    if logs[0].meta["kind"] == "bench":
        from kemba.identify.bench.problem import bench_problem

        return bench_problem(logs, model)
    if model.mechanism.rig == "vessel":
        from kemba.identify.rigs.vessel import vessel_problem

        return vessel_problem(logs, model, figures)
    if model.mechanism.rig:
        from kemba.identify.rigs.problem import rig_problem

        return rig_problem(logs, model, figures)
    from kemba.identify.robot.problem import robot_problem

    return robot_problem(logs, model)


def write_answer(answer: Answer, out: Path, model: str) -> None:
    """answer.json, and the model with what was found."""
    out.mkdir(parents=True, exist_ok=True)
    data: dict[str, Any] = answer.json()
    for stale in ("model.yaml", COVARIANCE, "answer.json"):
        (out / stale).unlink(missing_ok=True)
    if answer.writes:
        path = write_model(out / "model.yaml", model, data)
        answer.model = data["model"] = str(path)
    write_json(out / "answer.json", data | {"base": reference(model)})


PLANNED = ("body/x", "body/z", "body/pitch", "hip/q", "piston/x")


def compare_logs(
    logs: Sequence[str | Path],
    model: str = "planning",
    column_map: str | Path | None = None,
    run: str | Path | None = None,
    tell: Tell = silent,
) -> tuple[Comparison, Problem]:
    """Where `model` fails on these logs, and how far a planned `run` (a folder or a trajectory
    CSV) was missed. `tell` gets the name of every stage. Raises KembaError; BadData where the logs
    cannot be right."""
    tell("reading the logs")
    read = read_logs(logs, column_map)
    found, problem = compare_read(read, model, tell)
    if run is not None:
        plan = Trajectory.read(Path(run) / "trajectory.csv" if Path(run).is_dir() else run)
        found = replace(found, plan=missed(plan, read))
    return found, problem


def compare_read(
    read: Sequence[Trajectory], model: str, tell: Tell = silent
) -> tuple[Comparison, Problem]:
    """Where `model` fails on logs that were read. Raises as `compare_logs` does."""
    problem, _ = posed(read, model, tell)
    tell("learning the noise of the sensors")
    problem = _with_noise(problem)
    tell("comparing with the model")
    evidence = load_spec(model).evidence
    figures = _figures_felt(problem, evidence.figures) if evidence else {}
    return compare(problem, model, [str(log.meta["path"]) for log in read], figures), problem


def missed(plan: Trajectory, logs: Sequence[Trajectory]) -> Mapping[str, float]:
    """Largest distance of the logs from the plan, by header, while the plan lasts."""
    found: dict[str, float] = {}
    for log in logs:
        begun = min(log.time[0], 0.0) + plan.time[0]  # what comes before the plan is negative
        time = log.time - log.time[0] + begun
        during = (plan.time[0] <= time) & (time <= plan.time[-1])
        wanted = plan.interpolate(time[during])
        for name in wanted.names:
            if name in log and name.endswith(PLANNED):
                error = np.abs(log[name][during] - wanted[name])
                header = f"{name} [{log.unit(name)}]"
                found[header] = max(found.get(header, 0.0), float(np.nanmax(error)))
    return found
