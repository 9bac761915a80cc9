"""Figures of discoveries, of rounds of learning and of robustness."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from kemba.identify.answer import HELD_OUT
from kemba.identify.compare.compare import conditions
from kemba.identify.discover import Discovery
from kemba.identify.infer.linear import NULL, Hypothesis
from kemba.identify.infer.windows import free_starts
from kemba.identify.problem.problem import Rows
from kemba.plotting.comparison import (
    HEAT,
    bands_of,
    columns_of,
    draw_heat_maps,
    heat_height,
    plot_bands,
    plot_ladder,
)
from kemba.plotting.style import (
    BLUE,
    DASHES,
    GREY,
    VERMILLION,
    key_above,
    paper_figure,
    paper_style,
    save_figure,
)
from kemba.trajectory import Array, Trajectory

FEWEST = 30  # rows that make a span of the residual
SHOWN = 2.0  # s of residual drawn


def draw_discovery(found: Discovery, folder: Path) -> list[Path]:
    """Into `folder`: heat map before and after, the residual in time, the missing force and what
    was found of it, and the ladder of errors."""
    figures = {"heat_map": plot_cells(found), "residual": plot_residual(found)}
    figures["missing_force"] = plot_explained(found)
    if len(found.answer.ladder) > 1:
        names, unseen = zip(*found.answer.ladder, strict=True)
        split = found.answer.split_by
        kept = "held-out runs" if split == HELD_OUT else f"left-out {split}"
        figures["ladder"] = plot_ladder(names, found.fitted, unseen, kept)
    return [save_figure(f, folder / f"{name}.png") for name, f in figures.items()]


def theta_of(found: Discovery, hypothesis: Hypothesis) -> dict[str, float]:
    """What a model with these effects added would have: their figures, all others nominal."""
    search = found.search
    fitted = search.points[hypothesis].fit.theta
    listed = (search.problem.candidates[effect].keys() for effect in hypothesis)
    return {key: fitted[key] for keys in listed for key in keys}


@paper_style
def plot_cells(found: Discovery) -> Figure:
    """Error by noise, by channel and by motion and valve mode: of the start model, and with
    what was found."""
    steps = {"before: ": NULL, "after: ": found.best} if found.best else {"": NULL}
    problem = found.search.problem
    groups = {when + HEAT: conditions(problem, theta_of(found, h)) for when, h in steps.items()}
    first = next(iter(groups.values()))
    tables = columns_of(first)
    figure = paper_figure(heat_height(first, tables) * len(groups) + 0.3)
    draw_heat_maps(figure, groups, tables)
    return figure


def plot_explained(found: Discovery) -> Figure:
    """d(t) of the start model, with its 95 % band, and what was found of it."""
    problem = found.search.problem
    before = problem.missing_force(free_starts(problem))
    if not found.best:
        return plot_bands(bands_of(before))
    theta = free_starts(problem, theta_of(found, found.best))
    after = problem.missing_force(theta, before[0].strength)
    return plot_bands(bands_of(before, after), " + ".join(found.best))


@paper_style
def plot_residual(found: Discovery) -> Figure:
    """Whitened residual before and after, of the channel and in the seconds where the answer
    explains most; where nothing was found, where the error is largest."""
    search, rows = found.search, found.search.problem.rows()
    steps = {"before": NULL, **({"after": found.best} if found.best else {})}
    residuals = {
        when: search.problem.residual(search.points[h].fit.theta) for when, h in steps.items()
    }
    squares = residuals["before"] ** 2 - residuals.get("after", np.zeros(1)) ** 2
    own = _most(rows, squares)
    time = rows.time[own]
    figure = paper_figure(2.2)
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


JUMP = (("body/z", "body height [m]", 1.0), ("body/pitch", "pitch [deg]", 180.0 / np.pi))
STYLES = ((DASHES, GREY), ("-", VERMILLION))  # before learning, after it


@paper_style
def plot_executions(
    executed: Sequence[Trajectory], expected: Mapping[str, Trajectory], planned: Trajectory
) -> Figure:
    """Logs over the plan and over what models expect, all by the clock of the plan.

    `expected`: simulations by name, the one before learning first.
    """
    figure = paper_figure(3.6)
    rows = figure.subplots(len(JUMP), 1, sharex=True)
    for axes, (name, label, factor) in zip(rows, JUMP, strict=True):
        for i, log in enumerate(executed):
            axes.plot(
                log.time, factor * log[name], color=BLUE, lw=0.8, label="" if i else "executed"
            )
        for (what, motion), (dashes, hue) in zip(expected.items(), STYLES, strict=False):
            axes.plot(motion.time, factor * motion[name], label=what, ls=dashes, color=hue)
        axes.plot(planned.time, factor * planned[name], color="black", lw=0.6, label="planned")
        axes.set_ylabel(label)
    rows[-1].set_xlabel("time of the plan [s]")
    key_above(rows[0])
    return figure


@paper_style
def plot_rounds(
    rounds: Sequence[int], apex: Sequence[float], expected: tuple[int, float] | None = None
) -> Figure:
    """Apex errors [m] of the executed runs by round, and the one `expected` of the next run."""
    figure = paper_figure(2.0)
    axes = figure.add_subplot()
    axes.axhline(0.0, color=GREY, lw=0.6)
    axes.plot(rounds, 1e3 * np.asarray(apex), "o-", color=BLUE, label="executed")
    if expected is not None:
        axes.plot(*(expected[0], 1e3 * expected[1]), "o", mfc="none", color=BLUE, label="expected")
    axes.set_xlabel("run (0: before learning)")
    axes.set_ylabel("apex error [mm]")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    key_above(axes)
    return figure


@paper_style
def plot_robustness(
    apex: Array,
    landed: Array,
    ranks: Mapping[str, Mapping[str, float | None]],
    planned: float | None = None,
) -> Figure:
    """How high executions went and which landed, and which conditions matter.

    `apex` (m,) [m] and `landed` (m,) of every execution; `ranks`: rank correlations by condition,
    each with `landing` and `apex`, None where there is none; `planned` [m] is marked.
    """
    figure = paper_figure(max(2.0, 0.7 + 0.3 * len(ranks)))
    left, right = figure.subplots(1, 2)
    good = np.asarray(landed, dtype=bool)
    edges = np.histogram_bin_edges(apex, bins="auto")
    groups = {
        f"landed ({good.sum()})": (good, BLUE),
        f"fell ({(~good).sum()})": (~good, VERMILLION),
    }
    shown = {label: (apex[rows], hue) for label, (rows, hue) in groups.items() if rows.any()}
    values, hues = ([each[i] for each in shown.values()] for i in (0, 1))
    left.hist(values, edges, stacked=True, label=list(shown), color=hues)
    if planned is not None:
        left.axvline(planned, color=GREY, ls="--", label="plan")
    left.set_xlabel("apex [m]")
    left.set_ylabel("executions")
    key_above(left)
    size = {n: 2 * abs(r.get("landing") or 0) + abs(r.get("apex") or 0) for n, r in ranks.items()}
    order = sorted(ranks, key=lambda name: size[name])  # landing first
    for answer, hue, shift in (("landing", VERMILLION, 0.2), ("apex", BLUE, -0.2)):
        lengths: Sequence[float] = [ranks[name].get(answer) or 0.0 for name in order]
        right.barh(np.arange(len(order)) + shift, lengths, 0.36, color=hue, label=answer)
    right.axvline(0.0, color=GREY, lw=0.6)
    right.set_yticks(range(len(order)), order)
    right.set_xlim(-1.0, 1.0)
    right.set_xlabel("rank correlation")
    key_above(right)
    return figure
