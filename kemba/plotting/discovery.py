"""Figures of a discovery: where the error was and is, and how it fell."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from kemba.identify.discover import Found
from kemba.identify.problem import Array, Rows
from kemba.identify.rank import NULL
from kemba.plotting.diagnosis import plot_heat_map, plot_ladder
from kemba.plotting.style import (
    BLUE,
    GREY,
    VERMILLION,
    key_above,
    paper_figure,
    paper_style,
    save_figure,
)

FEWEST = 30  # rows that make a cell of the heat map
SHOWN = 2.0  # s of residual drawn


def draw_discovery(found: Found, folder: Path) -> list[Path]:
    """Heat map before and after, the residual in time, and the ladder of errors, into `folder`."""
    paths = [
        save_figure(plot_cells(found), folder / "heat_map.png"),
        save_figure(plot_residual(found), folder / "residual.png"),
    ]
    steps = found.answer.ladder
    if len(steps) > 1:
        names, errors = zip(*steps, strict=True)
        ladder = plot_ladder(names, errors)
        paths.append(save_figure(ladder, folder / "ladder.png"))
    return [Path(str(p)) for p in paths if p is not None]


def plot_cells(found: Found) -> Figure:
    """RMS of the whitened residual by channel and by motion and valve mode."""
    rows, residuals = _residuals(found)
    conditions = np.char.add(np.char.add(rows.phase.astype(str), " "), rows.mode.astype(str))
    names = [str(c) for c in np.unique(conditions)]
    tables = {
        title: np.array(
            [
                [_cell(r[(rows.channel == k) & (conditions == name)]) for name in names]
                for k in range(len(rows.channels))
            ]
        )
        for title, r in residuals.items()
    }
    seen = np.isfinite(next(iter(tables.values()))).any(axis=1)
    channels = [c for c, s in zip(rows.channels, seen, strict=True) if s]
    return plot_heat_map({t: v[seen] for t, v in tables.items()}, channels, names)


def _residuals(found: Found) -> tuple[Rows, dict[str, Array]]:
    search = found.search
    before = search.problem.residual(search.points[NULL].fit.theta)
    tables = {"before": before}
    if found.best:
        tables["after"] = search.problem.residual(search.points[found.best].fit.theta)
    return search.problem.rows(), tables


def _cell(r: Array) -> float:
    return float(np.sqrt(np.mean(r**2))) if len(r) >= FEWEST else float("nan")


@paper_style
def plot_residual(found: Found, figure: Figure | None = None) -> Figure:
    """Whitened residual of the channel that was worst, before and after, in the worst seconds."""
    rows, residuals = _residuals(found)
    before = residuals["before"]
    own = _worst(rows, before)
    time = rows.time[own]
    figure = paper_figure(2.2, figure=figure)
    axes = figure.add_subplot()
    looks: dict[str, Any] = {"before": VERMILLION, "after": BLUE}
    for title, r in residuals.items():
        axes.plot(time, r[own], lw=0.7, color=looks[title], label=title)
    axes.axhspan(-2, 2, color=GREY, alpha=0.2, lw=0, label="noise, 95 %")
    axes.set_xlabel("time [s]")
    axes.set_ylabel(f"{rows.channels[rows.channel[own][0]]}\nerror / noise")
    axes.margins(x=0)
    key_above(axes)
    return figure


def _worst(rows: Rows, r: Array) -> np.ndarray[Any, Any]:
    """Rows of the channel, run and span of time with the largest mean square."""
    score, best = -1.0, np.arange(len(r))
    for run in np.unique(rows.run):
        for channel in np.unique(rows.channel):
            own = np.flatnonzero((rows.run == run) & (rows.channel == channel))
            if not len(own):
                continue
            spans = ((rows.time[own] - rows.time[own][0]) / SHOWN).astype(int)
            for span in np.unique(spans):
                part = own[spans == span]
                power = float(np.mean(r[part] ** 2)) if len(part) >= FEWEST else -1.0
                if power > score:
                    score, best = power, part
    return best
