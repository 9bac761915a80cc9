"""Which runs and logs a round has behind it, as the run folders tell."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from kemba.config import dump_yaml
from kemba.errors import KembaError, enumerated
from kemba.files import sha256
from kemba.identify.adopt import reference
from kemba.model import load_spec
from kemba.ocp import Task
from kemba.plant.execution.controller import read_controller
from kemba.runs import Run, load_run
from kemba.trajectory import Array, Trajectory

SUPPLY = 0.7e6  # Pa, of a model that names none
ENTRY = "learn"  # of the manifest of a run that `learn` made


class MatchSettings:
    """When a log is an execution of a run."""

    valves = 0.02  # share of rows in which a valve command differs from the table


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
    """The runs in the order of their rounds, with their logs; earlier logs join in.

    Raises KembaError where a log is of none of the runs, or a held-out log was learnt from.
    """
    found = sorted((load_run(run) for run in runs), key=_round)
    executed: dict[int, list[Trajectory]] = {}
    for log in logs:
        place, timed = _placed(log, found)
        executed.setdefault(place, []).append(timed)
    entries = {e["round"]: e for run in found for e in _entries(run)}
    history = [entries[number] for number in sorted(entries)]
    told = {path: digest for entry in history for path, digest in entry["logs"].items()}
    earlier, remarks = _still_there(told)
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


def sent(table: Trajectory, time: Array, name: str) -> Array:
    """A valve command of a table at times (n,) [s] of its clock."""
    row = np.searchsorted(table.time, time + 1e-9, side="right") - 1
    return np.asarray(table[name][np.clip(row, 0, len(table) - 1)])


def _round(run: Run) -> int:
    return int(run.manifest.get(ENTRY, {}).get("round", 0))


def _entries(run: Run) -> list[dict[str, Any]]:
    own = run.manifest.get(ENTRY)
    return [*run.manifest.get("learnt_before", []), *([own] if own else [])]


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
    if miss > MatchSettings.valves:
        what = f"its valve commands differ from the run's in {miss:.0%} of the rows"
        hint = "give the run that was executed, or logs that begin where its controller.csv begins"
        raise KembaError(str(log.meta["path"]), what, f"an execution of {runs[place].path}", hint)
    columns = {h: log[n] for h, n in zip(log.headers, log.names, strict=True)}
    return place, Trajectory(time, columns, log.meta)


def _differs(table: Trajectory, log: Trajectory, time: Array) -> float:
    """The largest share of rows, at `time` [s], in which a valve command differs from the table."""
    names = [name for name in table.names if "/valve/" in name]
    if any(name not in log for name in names):
        return 1.0
    return max(float(np.mean(sent(table, time, n) != np.round(log[n]))) for n in names)


def as_executed(model: str, task: Task, path: Path) -> str:
    """A model with the supply and payload of a task, written to `path` where it needs them."""
    spec = load_spec(model)
    if not task.payload and task.supply in (None, spec.supply or SUPPLY):
        return model
    extra = [{"kind": "payload", "m": task.payload}] if task.payload else []
    data = {"name": f"{spec.name}_of_the_run", "base": reference(model), "effects": extra}
    dump_yaml(data | ({"supply": task.supply} if task.supply else {}), path)
    return str(path)
