"""Figures of a discovery: where the error was and is, the missing force and what explains it, and
how the error fell."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from kemba.identify.compare.compare import conditions
from kemba.identify.discover import Discovery
from kemba.identify.infer.spike_slab import NULL, Hypothesis
from kemba.identify.infer.windows import free_starts
from kemba.identify.problem.types import Array, Rows
from kemba.plotting.bands import plot_bands, plot_ladder
from kemba.plotting.heat import plot_heat_map
from kemba.plotting.study.comparison import bands_of, in_words, place_of
from kemba.plotting.style import (
    BLUE,
    GREY,
    VERMILLION,
    key_above,
    paper_figure,
    paper_style,
    save_figure,
)

FEWEST = 30  # rows that make a span of the residual
SHOWN = 2.0  # s of residual drawn


def draw_discovery(found: Discovery, folder: Path) -> list[Path]:
    """Into `folder`: heat map before and after, the residual in time, the missing force and what
    was found of it, and the ladder of errors."""
    figures = {"heat_map": plot_cells(found), "residual": plot_residual(found)}
    figures["missing_force"] = plot_explained(found)
    if len(found.answer.ladder) > 1:
        figures["ladder"] = plot_steps(found)
    return [save_figure(f, folder / f"{name}.png") for name, f in figures.items()]


def theta_of(found: Discovery, hypothesis: Hypothesis) -> dict[str, float]:
    """What a model with these effects added would have: their figures, all others nominal."""
    search = found.search
    fitted = search.points[hypothesis].fit.theta
    listed = (search.problem.candidates[effect].keys() for effect in hypothesis)
    return {key: fitted[key] for keys in listed for key in keys}


def plot_cells(found: Discovery) -> Figure:
    """Error by noise, by channel and by motion and valve mode: of the start model, and with
    what was found."""
    steps = {"before": NULL, "after": found.best} if found.best else {"": NULL}
    problem = found.search.problem
    listed = {t: conditions(problem, theta_of(found, h)) for t, h in steps.items()}
    first = next(iter(listed.values()))
    channels = list(dict.fromkeys(c.channel for c in first))
    columns = sorted({(c.phase, c.mode, c.region) for c in first}, key=place_of)
    tables, bold = {}, {}
    for title, group in listed.items():
        tables[title] = np.full((len(channels), len(columns)), np.nan)
        bold[title] = np.zeros(tables[title].shape, bool)
        for c in group:
            at = channels.index(c.channel), columns.index((c.phase, c.mode, c.region))
            tables[title][at], bold[title][at] = c.ratio, c.significant
    return plot_heat_map(tables, channels, in_words([(c[0], c[1], "") for c in columns]), bold)


def plot_explained(found: Discovery) -> Figure:
    """d(t) of the start model, with its 95 % band, and what was found of it."""
    problem = found.search.problem
    before = problem.missing_force(free_starts(problem))
    if not found.best:
        return plot_bands(bands_of(before))
    theta = free_starts(problem, theta_of(found, found.best))
    after = problem.missing_force(theta, before[0].strength)
    return plot_bands(bands_of(before, after), " + ".join(found.best))


def plot_steps(found: Discovery) -> Figure:
    """Errors of fitted and held-out data as effects are added: the numbers of the answer."""
    names, unseen = zip(*found.answer.ladder, strict=True)
    return plot_ladder(names, found.fitted, unseen)


def _residuals(found: Discovery) -> tuple[Rows, dict[str, Array]]:
    search = found.search
    before = search.problem.residual(search.points[NULL].fit.theta)
    tables = {"before": before}
    if found.best:
        tables["after"] = search.problem.residual(search.points[found.best].fit.theta)
    return search.problem.rows(), tables


@paper_style
def plot_residual(found: Discovery, figure: Figure | None = None) -> Figure:
    """Whitened residual before and after, of the channel and in the seconds where the answer
    explains most; where nothing was found, where the error is largest."""
    rows, residuals = _residuals(found)
    squares = residuals["before"] ** 2 - residuals.get("after", np.zeros(1)) ** 2
    own = _most(rows, squares)
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


def _most(rows: Rows, squares: Array) -> np.ndarray[Any, Any]:
    """Rows of the channel, run and span of time with the largest mean of `squares`."""
    score, best = -np.inf, np.arange(len(squares))
    for run in np.unique(rows.run):
        for channel in np.unique(rows.channel):
            own = np.flatnonzero((rows.run == run) & (rows.channel == channel))
            if not len(own):
                continue
            spans = ((rows.time[own] - rows.time[own][0]) / SHOWN).astype(int)
            for span in np.unique(spans):
                part = own[spans == span]
                mean = float(np.mean(squares[part]))
                if len(part) >= FEWEST and mean > score:
                    score, best = mean, part
    return best
