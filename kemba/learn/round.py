"""One round: compare, discover, adopt, plan anew, correct."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from kemba.config import Document, beside, dump_yaml
from kemba.errors import KembaError
from kemba.identify.adopt import reference, write_model
from kemba.identify.answer import Answer
from kemba.identify.compare_logs import compare_logs
from kemba.identify.discover import Discovery
from kemba.identify.logs.reading import read_logs
from kemba.identify.workflow import discover_logs
from kemba.learn import words
from kemba.learn.aim import Aim, Aimed
from kemba.learn.correction import (
    Correction,
    contradictions,
    correction_from,
    write_correction,
)
from kemba.learn.flight import FlownJump, flight_of
from kemba.learn.rounds import Past, entry, past_of
from kemba.logs import load_map
from kemba.model import Model, load_spec
from kemba.ocp import Task, load_task, task_model
from kemba.plant.execution.certificate import rest_after
from kemba.plant.execution.controller import execute
from kemba.plant.execution.replay import ends_standing
from kemba.plotting.robot.machine import Machine, load_machine
from kemba.report import solve_into
from kemba.runs import Run, RunFolder, write_json
from kemba.solve import Approach, Listener
from kemba.solve.earlier import origin_of
from kemba.solve.verdict import verdicts
from kemba.trajectory import Trajectory

PLAIN = "controller_uncorrected.csv"
SUPPLY = 0.7e6  # Pa, of a model that names none
LEARNT = ("missing", "partly")  # verdicts that give a model


@dataclass(frozen=True)
class Asked:
    """What `learn` is asked: runs, their logs, the task to plan next, and how."""

    runs: Sequence[str | Path]
    logs: Sequence[str | Path]
    target: str | Path
    overrides: Sequence[str] = ()
    holdout: Sequence[str | Path] = ()
    column_map: str | Path | None = None
    time_limit: float = 300.0  # of discover [s]
    correct: bool = True


@dataclass
class Round:
    """What a round found, for its page and its JSON."""

    past: Past
    model: str
    answer: Answer
    discovery: Discovery | None
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
    refused: tuple[str, ...] = ()  # why the learnt model is not `model`, which it else is

    @property
    def contradicted(self) -> tuple[str, ...]:
        """What `model` does otherwise than the executions, by more than is corrected, in words."""
        return contradictions(self.executed, self.simulated)

    @property
    def expected_apex_error(self) -> float | None:
        """Expected minus planned apex [m] of the new run."""
        if self.aimed is None or self.target is None:
            return None
        return self.aimed.expected.apex - self.target.apex

    @property
    def executed_apex_error(self) -> float:
        """Mean executed minus planned apex [m] of the run that was learnt from."""
        return float(np.mean([f.apex for f in self.executed])) - self.planned.apex

    @property
    def good(self) -> bool:
        """Whether there is a new plan that its model's executions confirm, and logs that model."""
        return bool(self.result.get("confirmed")) and not self.contradicted

    def json(self) -> dict[str, Any]:
        """The object that `--json` prints."""
        return {
            "round": self.past.round,
            "verdict": self.answer.verdict,
            "added": list(self.answer.added),
            "compare_before": self.compare_before,
            "compare_after": self.compare_after,
            "model": self.model,
            "run": self.result.get("run"),
            "expected_apex_error_m": self.expected_apex_error,
            "executed_apex_error_m": self.executed_apex_error,
            "unexplained_apex_m": self.correction.apex,
            "simulated_touchdown_s": finite(self.simulated.touchdown),
            "executed_touchdown_s": finite(float(np.mean([f.touchdown for f in self.executed]))),
            "contradicted": list(self.contradicted),
            "refused": list(self.refused),
            "good": self.good,
            "sentence": self.sentence,
        }

    @property
    def sentence(self) -> str:
        """The round in words."""
        failed = "" if self.good else f"FAILED: the next plan is not confirmed: {self._why}"
        return words.sentences(
            [
                failed,
                f"round {self.past.round}: {words.jumped(self.executed_apex_error)}",
                words.learnt(
                    self.answer.verdict, self.answer.added, self.compare_before, self.compare_after
                ),
                words.refused(self.refused, self.answer.added),
                words.expected(self.expected_apex_error),
            ]
        )

    @property
    def _why(self) -> str:
        if self.contradicted and self.result.get("confirmed"):
            return f"the executed plan's table, on its model, {' and '.join(self.contradicted)}"
        return str(self.result.get("sentence") or "there is none").removeprefix("FAILED: ")


def learn(asked: Asked, folder: RunFolder, listener: Listener) -> Round:
    """One round, written to `folder`: model, plan, corrected table, learning.json.

    Raises KembaError where runs, logs and target do not fit together, or the logs cannot be right.
    """
    columns = load_map(asked.column_map) if asked.column_map else None
    logs = read_logs(asked.logs, columns)
    past = past_of(asked.runs, logs, asked.holdout)
    run = past.runs[past.last]
    old = load_task(run.task)[0]
    found = _learnt(asked, past, run, old, folder, listener.tell)
    task, document = load_task(asked.target, list(asked.overrides))
    update = {"model": found.model, "plant": beside(task.plant, Path())}
    task = task.model_copy(update=update)
    if asked.correct:
        found = replace(found, correction=correction_from(found.executed, found.simulated))
    return _planned(found, task, document, folder, listener)


def _learnt(
    asked: Asked, past: Past, run: Run, old: Task, folder: RunFolder, tell: Callable[[str], None]
) -> Round:
    """Compare with the run's model, discover, compare with the model found."""
    kept, out = [*asked.holdout] or [*past.logs], folder / "answer"
    shutil.rmtree(out, ignore_errors=True)  # of a round that was killed
    out.mkdir()
    here = as_executed(old.model, old, out / "model_of_the_run.yaml")
    before, _ = compare_logs(kept, here, asked.column_map, tell=tell)
    answer, discovery = discover_logs(
        past.logs, asked.holdout, here, asked.column_map, asked.time_limit, tell, out
    )
    if answer.verdict == "bad-data":
        raise KembaError("--logs", answer.sentence, hint="see kemba-opt check LOG")
    model, after = old.model, before.noise_ratio
    if answer.verdict in LEARNT and answer.added:
        tell("comparing with what was learnt")
        file = write_model(out / "model.yaml", old.model, answer.json()["ranking"], answer.added)
        model = str(file.resolve())
        here = as_executed(model, old, out / "model_learnt_of_the_run.yaml")
        after = compare_logs(kept, here, asked.column_map)[0].noise_ratio
    machine = load_machine(old.model)
    table, plan = run.controller, run.trajectory
    found = Round(
        past=past,
        model=old.model,
        answer=answer,
        discovery=discovery,
        compare_before=before.noise_ratio,
        compare_after=after,
        planned=flight_of(plan, machine),
        executed=[flight_of(log, machine) for log in past.executed[past.last]],
        simulated=(unlearnt := _simulated(task_model(old), plan, table, machine)),
        before=unlearnt,
    )
    if model == old.model:
        return found
    learnt = task_model(old.model_copy(update={"model": model}))
    return with_model(found, model, _simulated(learnt, plan, table, machine))


def with_model(found: Round, model: str, simulated: FlownJump) -> Round:
    """The round with the learnt `model`, unless executions contradict more of what that does in
    simulation than of what the run's own model does."""
    told = contradictions(found.executed, simulated)
    if len(told) > len(found.contradicted):
        return replace(found, refused=told)
    return replace(found, model=model, simulated=simulated)


def as_executed(model: str, task: Task, path: Path) -> str:
    """A model with the supply and payload of a task, written to `path` where it needs them."""
    spec = load_spec(model)
    if not task.payload and task.supply in (None, spec.supply or SUPPLY):
        return model
    extra = [{"kind": "payload", "m": task.payload}] if task.payload else []
    data = {"name": f"{spec.name}_of_the_run", "base": reference(model), "effects": extra}
    dump_yaml(data | ({"supply": task.supply} if task.supply else {}), path)
    return str(path)


def finite(value: float) -> float | None:
    """A number as JSON has it: null where there is none."""
    return float(value) if np.isfinite(value) else None


def _simulated(model: Model, plan: Trajectory, table: Trajectory, machine: Machine) -> FlownJump:
    done = execute(table, model, extra=rest_after(model, plan, table))
    return flight_of(done.trajectory, machine)


def _planned(
    found: Round, task: Task, document: Document, folder: RunFolder, listener: Listener
) -> Round:
    """The target planned with the learnt model, from the old plan, and its table corrected."""
    past = found.past
    facts = {
        "verdict": found.answer.verdict,
        "added": list(found.answer.added),
        "model": found.model,
        "executed_apex_error_m": found.executed_apex_error,
        "compare_before": found.compare_before,
        "compare_after": found.compare_after,
    }
    folder.manifest |= entry(past, facts)
    origin = origin_of(past.runs[past.last].path)
    result = solve_into(folder, task, document, listener, Approach(origin=origin))
    result = {**result, "confirmed": _confirmed(result, task, folder / "trajectory.csv")}
    found = replace(found, result=result)
    if (folder / "controller.csv").is_file() and result["status"] != "infeasible":
        listener.tell("correction of the valve edges")
        found = _corrected(found, task, folder)
    write_json(folder / "learning.json", found.json())
    return found


def _corrected(found: Round, task: Task, folder: RunFolder) -> Round:
    """controller.csv with the correction in it; the plan's own table is kept beside it."""
    machine, model = load_machine(task.model), task_model(task)
    plain = Trajectory.read(folder / "controller.csv")
    plan = Trajectory.read(folder / "trajectory.csv")
    aimed = Aim(model, machine, plan, found.correction).corrected(plain)
    if any(k for edges in aimed.moved.values() for k in edges):
        plain.write(folder / PLAIN)
        columns = {h: aimed.table[n] for h, n in zip(plain.headers, plain.names, strict=True)}
        Trajectory(plain.time, columns, plain.meta).write(folder / "controller.csv")
    target = flight_of(plan, machine)
    reached = {
        "expected_apex_m": aimed.expected.apex,
        "planned_apex_m": target.apex,
        "expected_touchdown_s": aimed.expected.touchdown,
    }
    write_correction(folder / "correction.yaml", found.correction, aimed.moved, reached)
    return replace(found, aimed=aimed, target=target)


def _confirmed(result: dict[str, Any], task: Task, plan: Path) -> bool:
    """Whether the plan comes true on its own, learnt model; the shipped plant is no judge here."""
    executed = {key: result.get(key) for key in ("replay", "table_replay")}
    if not all(executed.values()):
        return False
    lands = bool(ends_standing(task_model(task), Trajectory.read(plan)))
    return all(v.good for v in verdicts(executed, task.tolerances, lands).values())
