"""From files to a comparison: read, check, predict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from kemba.identify.compare.compare import Comparison, compare
from kemba.identify.logs.reading import read_logs
from kemba.identify.problem.problem import Problem
from kemba.identify.workflow import admitted, check_all, model_of
from kemba.identify.written.quoted import heard, known
from kemba.logs import load_map
from kemba.model import load_spec
from kemba.stopwatch import Tell, silent
from kemba.trajectory import Trajectory

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
    columns = load_map(column_map) if column_map else None
    tell("reading the logs")
    read = read_logs(logs, columns)
    found, problem = compare_read(read, model, tell)
    if run is not None:
        plan = Trajectory.read(Path(run) / "trajectory.csv" if Path(run).is_dir() else run)
        found = replace(found, plan=missed(plan, read))
    return found, problem


def compare_read(
    read: Sequence[Trajectory], model: str, tell: Tell = silent
) -> tuple[Comparison, Problem]:
    """Where `model` fails on logs that were read. Raises as `compare_logs` does."""
    built = model_of(read, model)
    check_all(read, built)
    tell("finding the motion in the logs")
    problem, _ = admitted(read, built)
    tell("learning the noise of the sensors")
    problem = heard(problem)
    tell("comparing with the model")
    evidence = load_spec(model).evidence
    figures = known(problem, evidence.figures) if evidence else {}
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
