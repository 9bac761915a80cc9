"""Whether logs are those of a run: what they say of themselves, and the commands that they hold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kemba.errors import enumerated
from kemba.identify.logs.clock import in_plans_clock, start_of
from kemba.policy.settings import PolicySettings
from kemba.runs import Run
from kemba.settings import CHOSEN, Settings, setting
from kemba.trajectory import Array, Trajectory

POLICY = "policy.npz"
OPEN = "SHARE of the time in which valves are open"


class BelongingSettings(Settings):
    """When the commands of a log are not those of a run."""

    share: float = setting(
        0.02, "1", "of the time in which valves are open, with another command than the run's",
        "tuned: own logs of five simulated runs 0, jumps to 0.50 and 0.51 m 0.05", decides=True,
    )  # fmt: skip
    step: float = setting(5e-4, "s", "between the times that are compared", CHOSEN)
    tick: float = setting(1e-3, "s", "period of the controller, by which edges may be off", CHOSEN)


@dataclass(frozen=True)
class Stranger:
    """A log that does not belong to the run: why, and of which run it was made by its own words;
    `share`: of the open time of the valves with other commands, 0 where that is not the reason."""

    name: str
    why: str
    made_of: str = ""
    share: float = 0.0


def strangers(run: Run, logs: Sequence[Trajectory]) -> list[Stranger]:
    """The logs that are not executions of a run, as far as legs, commands and sidecars tell.

    Commands decide: the folder of a run may have another name today. Only a log without commands
    is judged by the name that its sidecar gives.
    """
    if not (run.path / "controller.csv").is_file():
        return []
    found = []
    for log in logs:
        name, made_of = str(log.meta.get("name", "the log")), str(log.meta.get("repeat_of", ""))
        share = other_commands(log, run.controller, _moved(run))
        why = _reason(log, run, made_of, share)
        if why:
            found.append(Stranger(name, why, made_of, share or 0.0))
    return found


def _reason(log: Trajectory, run: Run, made_of: str, share: float | None) -> str:
    """Why a log is not one of the run, as part of a sentence; empty where nothing speaks
    against it."""
    theirs, ours = _legs(log), _legs(run.controller)
    if log.meta.get("kind", "robot") != "robot":
        return f"it is of a rig ({log.meta['kind']}), and the run is that of a robot"
    if theirs and theirs != ours:
        return f"its legs are {', '.join(theirs)}, those of the run's robot {', '.join(ours)}"
    other = made_of if made_of not in ("", run.path.resolve().name) else ""
    if share is None:
        return f"it was made of the run {other}" if other else ""
    if share <= BelongingSettings.current().share:
        return ""
    made = f"; it was made of the run {other}" if other else ""
    return f"its valve commands are not those of controller.csv for {OPEN}{made}"


def other_commands(log: Trajectory, table: Trajectory, moved: float = 0.0) -> float | None:
    """The share of the time in which valves are open where the log holds another command than the
    table; None without commands. Edges may be off by a sample, a tick and `moved` [s]."""
    settings, shown = BelongingSettings.current(), in_plans_clock(log, table)
    names = [name for name in table.names if "/valve/" in name and name in shown]
    sent = table.time + start_of(table) - table.time[0]
    begin, end = max(sent[0], shown.time[0]), min(sent[-1], shown.time[-1])
    if not names or end <= begin:
        return None
    grid = np.arange(begin, end, settings.step)
    off = moved + settings.tick + float(np.median(np.diff(shown.time)))
    wrong, is_open = 0, 0
    for name in names:
        ours = _held(sent, table[name], grid)
        theirs = _held(shown.time, shown[name], grid)
        near = _held(sent, table[name], grid[:, None] + np.linspace(-off, off, 9))
        wrong += int(np.sum(np.where(theirs, ~near.any(axis=1), near.all(axis=1))))
        is_open += int(np.sum(np.logical_or(ours, theirs)))
    return wrong / is_open if is_open else None


def doubt(found: Sequence[Stranger], run: Run) -> str:
    """What speaks against the logs, in sentences; empty without any."""
    groups: dict[str, list[Stranger]] = {}
    for one in found:
        groups.setdefault(one.why, []).append(one)
    return " ".join(_sentence(alike, run) for alike in groups.values())


def own_run(found: Sequence[Stranger], run: Run) -> Path | None:
    """The run beside this one of which all these logs were made, by their own words."""
    named = {one.made_of for one in found} - {""}
    beside = run.path.parent / named.pop() if len(named) == 1 else None
    return beside if beside is not None and (beside / "manifest.json").is_file() else None


def _sentence(alike: Sequence[Stranger], run: Run) -> str:
    """About logs with the same reason; of their shares the largest is given."""
    names = [one.name for one in alike]
    most = f"{100 * max(one.share for one in alike):.0f} %"
    why = alike[0].why.replace("SHARE", most if len(names) == 1 else f"up to {most}")
    if len(names) == 1:
        return f"{names[0]} does not belong to {run.path}: {why}."
    return f"{enumerated(names)} do not belong to {run.path}; of each: {why}."


def _legs(table: Trajectory) -> tuple[str, ...]:
    return tuple(sorted(n.split("/")[0] for n in table.names if n.endswith("/hip/q")))


def _moved(run: Run) -> float:
    """By how much [s] the run's feedback may move an edge."""
    return 1e-3 * PolicySettings.current().latest if (run.path / POLICY).is_file() else 0.0


def _held(time: Array, command: Array, at: Array) -> Array:
    """Whether a valve is commanded on at times of any shape; each row holds until the next."""
    row = np.clip(np.searchsorted(time, at + 1e-9, side="right") - 1, 0, None)
    return np.asarray(np.nan_to_num(command)[row] > 0.5)
