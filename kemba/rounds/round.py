"""One round: discover, adopt what predicts better, plan anew, correct what is left."""

import shutil
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from kemba.config import Document, beside, dump_yaml, find_config
from kemba.errors import KembaError, enumerated
from kemba.files import sha256, write_json
from kemba.identify.adopt import reference, write_model
from kemba.identify.answer import Answer
from kemba.identify.logs.reading import read_logs
from kemba.identify.workflow import discover_logs
from kemba.model import Model, load_spec
from kemba.model.model import NOMINAL_SUPPLY
from kemba.ocp import Task, load_task, task_model
from kemba.plant.certificate import rest_after
from kemba.plant.controller import execute, read_controller
from kemba.plotting.source import load_machine
from kemba.report.solving import solve_into
from kemba.rounds import outcome
from kemba.rounds.correction import (
    Aim,
    Aimed,
    Correction,
    FlownJump,
    correction_from,
    flight_of,
    scatter_of,
    write_correction,
)
from kemba.rounds.outcome import ExpectedApex, band_about, expected_of
from kemba.runs import Run, RunFolder, load_run
from kemba.solve import Approach, Listener
from kemba.solve.earlier import origin_of
from kemba.trajectory import Array, Trajectory

ENTRY = "learn"  # of the manifest of a run that `learn` made


OTHER = 0.02  # share of rows in which a valve command differs from the table: another run's log


@dataclass(frozen=True)
class Past:
    """What a new round knows: its number, the runs, the logs of each, and all logs to fit.

    `executed` maps the places of `runs` to the new logs of that run, by the clock of its plan;
    `history` holds the entries of earlier rounds, `remarks` what became of their logs.
    """

    round: int
    runs: tuple[Run, ...]
    executed: dict[int, list[Trajectory]]
    logs: tuple[Path, ...]
    history: list[dict[str, Any]] = field(default_factory=list)
    remarks: tuple[str, ...] = ()

    @property
    def last(self) -> int:
        """The place of the last run that was executed."""
        return max(self.executed)


def past_of(
    runs: Sequence[str | Path], logs: Sequence[Trajectory], holdout: Iterable[str | Path] = ()
) -> Past:
    """The runs in the order of their rounds, with their logs; earlier logs join in. Raises
    KembaError where a log is of none of the runs, or a held-out log was learnt from."""
    found = sorted((load_run(run) for run in runs), key=_round)
    executed: dict[int, list[Trajectory]] = {}
    for log in logs:
        place, timed = _placed(log, found)
        executed.setdefault(place, []).append(timed)
    manifests = [run.manifest for run in found]
    told = [e for m in manifests for e in (*m.get("learnt_before", ()), m.get(ENTRY)) if e]
    entries = {entry["round"]: entry for entry in told}
    history = [entries[number] for number in sorted(entries)]
    fitted = {path: digest for entry in history for path, digest in entry["logs"].items()}
    earlier, remarks = _still_there(fitted)
    new = [Path(log.meta["path"]) for log in logs]
    listed = {path.resolve(): path for path in [*earlier, *new] if path.is_file()}
    used = {digest for entry in history for digest in entry["logs"].values()}
    for path in holdout:
        if Path(path).resolve() in listed or sha256(path) in used:
            what = "was already learnt from, so it cannot judge what was learnt"
            raise KembaError(str(path), what, hint="keep another log with --holdout")
    number = 1 + max(map(_round, found))
    logs_of_all = tuple(listed.values())
    return Past(number, tuple(found), executed, logs_of_all, history, remarks)


def _still_there(told: Mapping[str, str]) -> tuple[list[Path], tuple[str, ...]]:
    """Logs of earlier rounds, by path and SHA-256, that are as they were, and a remark on those
    that are not: they are not fitted again."""
    kept, gone, changed = [], [], []
    for path, digest in told.items():
        if not Path(path).is_file():
            gone.append(path)
        elif sha256(path) != digest:
            changed.append(path)
        else:
            kept.append(Path(path))
    what = {"of an earlier round is gone": gone, "has changed since an earlier round": changed}
    remarks = [f"{enumerated(n)} {text}: not fitted again" for text, n in what.items() if n]
    return kept, tuple(remarks)


def entry(past: Past, facts: dict[str, Any]) -> dict[str, Any]:
    """What the manifest of a new run says of its round, earlier rounds included."""
    logs = {str(path.resolve()): sha256(path) for path in past.logs}
    own = {"round": past.round, "runs": [str(r.path) for r in past.runs], "logs": logs, **facts}
    return {ENTRY: own, "learnt_before": past.history}


def _round(run: Run) -> int:
    return int(run.manifest.get(ENTRY, {}).get("round", 0))


def _placed(log: Trajectory, runs: Sequence[Run]) -> tuple[int, Trajectory]:
    """The run whose valve commands the log shows, and the log by the clock of that run's plan.

    A log begins where the table begins, or it has the plan's clock already.
    """
    tried = []
    for place, run in enumerate(runs):
        table = read_controller(run.controller)
        for begin in (float(log.time[0]), float(table.time[0])):
            time = log.time - log.time[0] + begin
            tried.append((_differs(table, log, time), place, time))
    miss, place, time = min(tried, key=lambda trial: trial[0])
    if miss > OTHER:
        what = f"its valve commands differ from the run's in {miss:.0%} of the rows"
        hint = "give the run that was executed, or logs that begin where its controller.csv begins"
        raise KembaError(str(log.meta["path"]), what, f"an execution of {runs[place].path}", hint)
    return place, log.at_times(time)


def _differs(table: Trajectory, log: Trajectory, time: Array) -> float:
    """The largest share of rows, at `time` [s], in which a valve command differs from the table."""
    names = [name for name in table.names if "/valve/" in name]
    if any(name not in log for name in names):
        return 1.0
    return max(float(np.mean(table.held(n, time) != np.round(log[n]))) for n in names)


def as_executed(model: str, task: Task, path: Path) -> str:
    """A model with the supply and payload of a task, written to `path` where it needs them."""
    spec = load_spec(model)
    if not task.payload and task.supply in (None, spec.supply or NOMINAL_SUPPLY):
        return model
    extra = [{"kind": "payload", "m": task.payload}] if task.payload else []
    data = {"name": f"{spec.name}_of_the_run", "base": reference(model), "effects": extra}
    dump_yaml(data | ({"supply": task.supply} if task.supply else {}), path)
    return str(path)


PLAIN = "controller_uncorrected.csv"
LEARNING = 0.5  # share of the time limit of a round that is for what its model lacks
PLANNING = 0.8  # share of the time left that the plan may take; the rest is for its correction


@dataclass(frozen=True)
class Asked:
    """What `learn` is asked: runs, their logs, the task to plan next, and how."""

    runs: Sequence[str | Path]
    logs: Sequence[str | Path]
    target: str | Path
    overrides: Sequence[str] = ()
    holdout: Sequence[str | Path] = ()
    column_map: str | Path | None = None
    time_limit: float = 600.0  # of the round [s]
    correct: bool = True


@dataclass
class Round:
    """What a round found, for its page and its JSON."""

    past: Past
    model: str
    answer: Answer
    compare_before: float
    compare_after: float
    planned: FlownJump
    executed: list[FlownJump]
    simulated: FlownJump
    before: FlownJump  # simulated on the model before this round
    correction: Correction = field(default_factory=Correction)
    result: dict[str, Any] = field(default_factory=dict)
    aimed: Aimed | None = None
    target: FlownJump | None = None
    was_expected: ExpectedApex | None = None  # of the run that was executed, by the round before
    next_expected: ExpectedApex | None = None
    remarks: tuple[str, ...] = ()

    @property
    def executed_apex(self) -> float:
        """Mean executed apex [m]."""
        return float(np.mean([f.apex for f in self.executed]))

    @property
    def executed_touchdown(self) -> float:
        """Mean executed touchdown [s]; NaN where a run did not come down."""
        return float(np.mean([f.touchdown for f in self.executed]))

    @property
    def expected_apex_error(self) -> float | None:
        """Expected minus planned apex [m] of the new run."""
        if self.aimed is None or self.target is None:
            return None
        return self.aimed.expected.apex - self.target.apex

    @property
    def executed_apex_error(self) -> float:
        """Mean executed minus planned apex [m] of the run that was learnt from."""
        return self.executed_apex - self.planned.apex

    @property
    def good(self) -> bool:
        """Whether there is a new plan that its model's executions confirm."""
        return bool(self.result.get("confirmed"))

    @property
    def facts(self) -> dict[str, Any]:
        """What later rounds are told of this one, beside its runs and logs."""
        return {
            "verdict": self.answer.verdict,
            "added": list(self.answer.added),
            "model": self.model,
            "executed_apex_error_m": self.executed_apex_error,
            "executed_apex_m": self.executed_apex,
            "was_expected": self.was_expected and self.was_expected.json(),
            "effects": outcome.effects(self.answer),
            "compare_before": self.compare_before,
            "compare_after": self.compare_after,
        }

    def json(self) -> dict[str, Any]:
        """The object that `--json` prints."""
        return {
            "round": self.past.round,
            **{name: value for name, value in self.facts.items() if name != "effects"},
            "run": self.result.get("run"),
            "expected_apex_error_m": self.expected_apex_error,
            "inside": self.was_expected and self.was_expected.holds(self.executed_apex),
            "next_expected": self.next_expected and self.next_expected.json(),
            "unexplained_apex_m": self.correction.apex,
            "simulated_touchdown_s": self.simulated.touchdown,
            "executed_touchdown_s": self.executed_touchdown,
            "remarks": list(self.remarks),
            "good": self.good,
            "sentence": self.sentence,
        }

    @property
    def sentence(self) -> str:
        """The round in words."""
        why = str(self.result.get("sentence") or "there is none").removeprefix("FAILED: ")
        failed = "" if self.good else f"FAILED: the next plan is not confirmed: {why}"
        told = outcome.jumped(self.executed_apex_error)
        inside = outcome.against(self.was_expected, self.executed_apex)
        return outcome.sentences(
            [
                failed,
                f"round {self.past.round}: {told}{inside}",
                outcome.learnt(
                    self.answer.verdict, self.answer.added, self.compare_before, self.compare_after
                ),
                outcome.expected(self.next_expected, self.target.apex if self.target else None),
                *self.remarks,
            ]
        )


def learn_into(
    asked: Asked, out: str | Path | None, listener: Listener, force: bool = False
) -> tuple[Round, RunFolder]:
    """One round in a new run folder, `out` or a numbered one. Raises KembaError as `learn`."""
    name = load_task(asked.target, list(asked.overrides))[0].name  # mistakes first
    inputs = [find_config(asked.target, "tasks"), *asked.logs]
    folder = RunFolder.create(out, name, inputs, force=force)
    try:
        return learn(asked, folder, listener), folder
    except BaseException:
        if folder.lock is not None:
            folder.finish("failed")
        raise


def learn(asked: Asked, folder: RunFolder, listener: Listener) -> Round:
    """One round, written to `folder`: model, plan, corrected table, learning.json.

    A share of its time limit is for discovery, most of what is then left for the plan.

    Raises KembaError where runs, logs and target do not fit together, or the logs cannot be right.
    """
    due = time.monotonic() + asked.time_limit
    logs = read_logs(asked.logs, asked.column_map)
    past = past_of(asked.runs, logs, asked.holdout)
    run = past.runs[past.last]
    old = load_task(run.task)[0]
    found = _learnt(asked, past, run, old, folder, listener.tell)
    task, document = load_task(asked.target, list(asked.overrides))
    update: dict[str, Any] = {"model": found.model, "plant": beside(task.plant, Path())}
    if asked.correct:
        found = replace(found, correction=correction_from(found.executed, found.simulated))
    left = min(task.solver.time_limit, max(0.1, PLANNING * (due - time.monotonic())))
    update["solver"] = task.solver.model_copy(update={"time_limit": left})
    task = task.model_copy(update=update)
    return _planned(found, task, document, folder, listener)


def _learnt(
    asked: Asked, past: Past, run: Run, old: Task, folder: RunFolder, tell: Callable[[str], None]
) -> Round:
    """Discover what the run's model lacks; the model is the one found, where it predicts better."""
    out = folder / "answer"
    shutil.rmtree(out, ignore_errors=True)  # of a round that was killed
    out.mkdir()
    here = as_executed(old.model, old, out / "model_of_the_run.yaml")
    answer, _ = discover_logs(
        past.logs, asked.holdout, here, asked.column_map, asked.time_limit, tell, out, LEARNING
    )
    if answer.verdict == "bad-data":
        raise KembaError("--logs", answer.sentence, hint="see kemba-opt check LOG")
    model = old.model
    if answer.model and answer.error_after < answer.error_before:
        model = str(write_model(out / "model.yaml", old.model, answer.json()).resolve())
    machine = load_machine(old.model, scene=old.scene)
    table, plan = run.controller, run.trajectory
    before = simulated = flight_of(executed_on(task_model(old), plan, table), machine)
    if model != old.model:
        learnt = task_model(old.model_copy(update={"model": model}))
        simulated = flight_of(executed_on(learnt, plan, table), machine)
    return Round(
        past=past,
        model=model,
        answer=answer,
        compare_before=answer.error_before,
        compare_after=answer.error_after,
        planned=flight_of(plan, machine),
        executed=[flight_of(log, machine) for log in past.executed[past.last]],
        simulated=simulated,
        before=before,
        was_expected=expected_of(run),
        remarks=(*past.remarks, *outcome.few(past.logs)),
    )


def executed_on(model: Model, plan: Trajectory, table: Trajectory) -> Trajectory:
    """What a model does with the table of a plan, until it has come to rest."""
    return execute(table, model, extra=rest_after(model, plan, table)).trajectory


def _planned(
    found: Round, task: Task, document: Document, folder: RunFolder, listener: Listener
) -> Round:
    """The target planned with the learnt model, from the old plan, and its table corrected."""
    past = found.past
    folder.manifest |= entry(past, found.facts)
    origin = origin_of(past.runs[past.last].path)
    result = solve_into(folder, task, document, listener, Approach(origin=origin))
    result = {**result, "confirmed": result["good"]}
    found = replace(found, result=result)
    if (folder / "controller.csv").is_file() and result["status"] != "infeasible":
        listener.tell("correction of the valve edges")
        found = _corrected(found, task, folder)
    write_json(folder / "learning.json", found.json())
    return found


def _corrected(found: Round, task: Task, folder: RunFolder) -> Round:
    """controller.csv with the correction in it; the plan's own table is kept beside it."""
    machine, model = load_machine(task.model, scene=task.scene), task_model(task)
    plain = Trajectory.read(folder / "controller.csv")
    plan = Trajectory.read(folder / "trajectory.csv")
    aimed = Aim(model, machine, plan, found.correction).corrected(plain)
    if any(k for edges in aimed.moved.values() for k in edges):
        plain.write(folder / PLAIN)
        aimed.table.at_times(plain.time).write(folder / "controller.csv")
    target = flight_of(plan, machine)
    reached = {
        "expected_apex_m": aimed.expected.apex,
        "planned_apex_m": target.apex,
        "expected_touchdown_s": aimed.expected.touchdown,
    }
    write_correction(folder / "correction.yaml", found.correction, aimed.moved, reached)
    rest = rest_after(model, plan, aimed.table)
    middle, scatter = aimed.expected.apex, scatter_of(found.executed)
    band, said = band_about(middle, aimed.table, model, task.model, machine, rest, scatter)
    found = replace(found, remarks=(*found.remarks, *said))
    return replace(found, aimed=aimed, target=target, next_expected=band)
