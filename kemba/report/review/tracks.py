"""The motions on a page: the plan, the simulated robot's and the measured ones, on one clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from kemba.identify.logs.clock import in_plans_clock
from kemba.plotting import Source, load_source
from kemba.runs import PLANT_RUN, Run
from kemba.trajectory import Array, Trajectory

Role = Literal["plan", "plant", "log"]


POINTS = 1000  # of every curve, so that the page opens fast
BEFORE, AFTER = 0.1, 0.4  # s; shown of a log before the plan begins and after its end
DRAWN = 5  # logs drawn over each other; more cannot be told apart
COMPARED = 2  # logs that the model is compared with: more take longer than 10 s


@dataclass(frozen=True)
class Track:
    """One motion in the plan's clock, with its name on the page."""

    name: str
    role: Role
    source: Source

    @property
    def t(self) -> Trajectory:
        """Its columns."""
        return self.source.trajectory


def gather(run: Run | None, logs: Sequence[Trajectory]) -> list[Track]:
    """The plan and the simulated robot of a run, as far as it has them, then the logs."""
    tracks = _of_run(run) if run else []
    table = None
    if run and (run.path / "controller.csv").is_file():
        table = run.controller
    for log in logs[:DRAWN]:
        shown = log if table is None else in_plans_clock(log, table)
        tracks.append(Track(str(log.meta["name"]), "log", Source(log.meta["name"], shown)))
    return tracks


def _of_run(run: Run) -> list[Track]:
    tracks = []
    if (run.path / "trajectory.csv").is_file():
        tracks.append(Track("plan", "plan", load_source(run.path)))
    if (run.path / PLANT_RUN).is_file():
        tracks.append(Track("simulated robot", "plant", load_source(run.path / PLANT_RUN)))
    return tracks


def plan_of(tracks: Sequence[Track]) -> Track | None:
    """The plan among them."""
    return next((track for track in tracks if track.role == "plan"), None)


def grid_of(tracks: Sequence[Track]) -> Array:
    """Times (n,) [s] that all curves share: of the plan with a little around it, else of all."""
    plan = plan_of(tracks)
    low = min(float(track.t.time[0]) for track in tracks)
    high = max(float(track.t.time[-1]) for track in tracks)
    if plan:
        low = max(low, float(plan.t.time[0]) - BEFORE)
        high = min(high, float(plan.t.time[-1]) + AFTER)
    step = 1e-3 * max(1.0, np.ceil((high - low) / POINTS * 1e3))
    first, last = np.ceil(low / step - 1e-6), np.floor(high / step + 1e-6)
    return np.asarray(np.arange(first, last + 1) * step)


def on_grid(track: Track, name: str, grid: Array, steps: bool = False) -> Array:
    """A column at the times (n,) of the grid; NaN before it begins and after it ends."""
    t = track.t
    values = t[name]
    known = np.isfinite(values)
    if not known.any():
        return np.full(len(grid), np.nan)
    if steps:
        if track.source.plan:
            row = np.searchsorted(t.time, grid - 1e-9, side="left")
        else:
            row = np.searchsorted(t.time, grid + 1e-9, side="right") - 1
        found = track.source.held(name)[np.clip(row, 0, len(t) - 1)]
    else:
        found = np.interp(grid, t.time[known], values[known])
    outside = (grid < t.time[0] - 1e-9) | (grid > t.time[-1] + 1e-9)
    return np.where(outside, np.nan, found)
