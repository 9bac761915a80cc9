"""Executions of a run under the conditions that its feedback is made for."""

from __future__ import annotations

from pathlib import Path

from kemba.errors import KembaError
from kemba.events import UPRIGHT, turned
from kemba.plant.controller import execute_many, read_controller
from kemba.plant.repeat import plant_of
from kemba.runs import load_run
from kemba.scenarios.conditions import standing
from kemba.scenarios.draw import scenarios
from kemba.trajectory import Trajectory

FILE = "twice"  # of configs/uncertainties
COUNT = 64  # scenarios from which feedback learns what to expect


def executions_of(run: str | Path, jobs: int | None = None) -> list[Trajectory]:
    """The table of a run executed open loop on its task's plant under drawn uncertainties.

    Those that cannot be simulated or do not end as upright as the plan are left out. Raises
    KembaError where the run has no table or no plan.
    """
    table, plant = read_controller(run), plant_of(run)
    cases = scenarios(FILE, plant, COUNT)
    asked = [{"model": c.model, "start": standing(c.model, table, c.start)} for c in cases]
    pitch = float(load_run(run).trajectory["body/pitch"][-1])
    done = [d for d in execute_many(table, asked, jobs) if not isinstance(d, KembaError)]
    return [d.trajectory for d in done if turned(d.trajectory["body/pitch"][-1], pitch) <= UPRIGHT]
