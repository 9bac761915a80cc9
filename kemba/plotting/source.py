"""What is plotted: trajectories with a name for the legend and how their commands are held."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.logs import ColumnMap, open_log
from kemba.trajectory import Array, Trajectory

PLAN_FILE = "trajectory.csv"
Mask = np.ndarray[Any, np.dtype[np.bool_]]

HIDDEN = ("controller", "simulation")  # file names that need their folder to be clear


@dataclass(frozen=True)
class Source:
    """A trajectory to plot.

    `plan`: row k of a command or contact force acts on the interval before it, as in implicit
    Euler; otherwise (a log, a simulation) it holds from its row until the next.
    """

    name: str
    trajectory: Trajectory
    plan: bool = False
    path: Path | None = None

    @property
    def bench(self) -> bool:
        """Whether it comes from a rig rather than from a robot."""
        kind = self.trajectory.meta.get("kind")
        known = any(name in self.trajectory for name in ("piston/x", "axis/q", "vessel/P"))
        return kind in ("bench", "cylinder", "drive", "vessel") or (kind is None and known)

    def held(self, name: str) -> Array:
        """The column (n,) of a command, in its unit, as it is drawn.

        The first row of a plan acts on no interval; it shows the value of the second.
        """
        values = self.trajectory[name]
        return np.concatenate([values[1:2], values[1:]]) if self.plan else values

    def spans(self, active: Mask) -> list[tuple[float, float]]:
        """Start and end [s] of every time in which the rows `active` (n,) hold without a break."""
        time = self.trajectory.time
        on = active[1:] if self.plan else active[:-1]
        edges = np.flatnonzero(np.diff(np.concatenate([[False], on.astype(bool), [False]])))
        return [(time[a], time[b]) for a, b in edges.reshape(-1, 2)]


def is_plan(trajectory: Trajectory, path: Path | None = None) -> bool:
    """Whether the rows are nodes of a plan: by its metadata, or without them by its file name."""
    kind = trajectory.meta.get("kind")
    return kind == "plan" if kind else path is not None and path.name == PLAN_FILE


def load_source(path: str | Path, columns: ColumnMap | None = None) -> Source:
    """The plan in a run folder, or the trajectory in a log file; `columns` maps foreign columns.

    Raises KembaError.
    """
    path = Path(path)
    file = path / PLAN_FILE if path.is_dir() else path
    if not file.is_file():
        what = f"has no {PLAN_FILE}" if path.is_dir() else "no such file or folder"
        runs = ", ".join(str(found.parent) for found in sorted(Path("runs").glob(f"*/{PLAN_FILE}")))
        expected = "a run folder or a log was expected"
        raise KembaError(str(path), what, expected, f"runs here: {runs}" if runs else "")
    trajectory = open_log(file, columns, strict=columns is None)
    if len(trajectory) < 2:
        raise KembaError(str(file), "has one row only", "at least two were expected")
    return Source(_name(file), trajectory, is_plan(trajectory, file), file)


def load_sources(paths: Iterable[str | Path], columns: ColumnMap | None = None) -> list[Source]:
    """Several of them, with names that differ."""
    sources = [load_source(path, columns) for path in paths]
    counts = Counter(source.name for source in sources)
    return [
        replace(source, name=str(path)) if counts[source.name] > 1 else source
        for source, path in zip(sources, paths, strict=True)
    ]


def default_path(sources: Sequence[Source]) -> Path:
    """Where a figure without a name goes: into the first one's run folder, or beside its CSV."""
    file = sources[0].path or Path(PLAN_FILE)
    if len(sources) > 1:
        return file.with_name("overlay.png")
    return file.with_name("figure.png") if file.name == PLAN_FILE else file.with_suffix(".png")


def _name(file: Path) -> str:
    folder = file.resolve().parent.name
    if file.name == PLAN_FILE:
        return folder or file.stem
    return f"{folder} {file.stem}" if file.stem in HIDDEN else file.stem
