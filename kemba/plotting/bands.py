"""Figures for comparing and identifying: estimates with bands, ladder of errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kemba.plotting.panels import shade
from kemba.plotting.style import (
    BLUE,
    DASHES,
    GREY,
    INK,
    VERMILLION,
    key_above,
    paper_figure,
    paper_style,
)
from kemba.trajectory import Array


@dataclass(frozen=True)
class Band:
    """An estimate in time (n,) with the `low` and `high` ends of its interval.

    `explained`: the part that a candidate effect explains; `stance`: spans [s] to shade.
    """

    label: str
    time: Array
    estimate: Array
    low: Array
    high: Array
    explained: Array | None = None
    stance: Sequence[tuple[float, float]] = ()


@paper_style
def plot_bands(
    bands: Sequence[Band], explained: str = "explained", figure: Figure | None = None
) -> Figure:
    """Estimates such as the missing force d(t), one panel each, with bands and a line at zero."""
    figure = paper_figure(0.95 * len(bands) + 0.55, figure=figure)
    grid = figure.subplots(len(bands), 1, squeeze=False, sharex=True)[:, 0]
    for axes, band in zip(grid, bands, strict=True):
        draw_band(axes, band, explained)
    key_above(grid[0])
    grid[-1].set_xlabel("time [s]")
    figure.align_ylabels()
    return figure


def draw_band(axes: Axes, band: Band, explained: str = "explained") -> None:
    """One estimate with its interval and a line at zero."""
    shade(axes, band.stance)
    axes.axhline(0.0, color=GREY, lw=0.6, zorder=1)
    axes.fill_between(
        band.time, band.low, band.high, color=BLUE, alpha=0.25, lw=0, label="95 %", zorder=2
    )
    axes.plot(band.time, band.estimate, color=BLUE, label="estimate", zorder=3)
    if band.explained is not None:
        axes.plot(band.time, band.explained, color=VERMILLION, ls=DASHES, label=explained, zorder=4)
    axes.set_ylabel(band.label)
    axes.margins(x=0)


@paper_style
def plot_ladder(
    steps: Sequence[str],
    fitted: Sequence[float],
    held_out: Sequence[float] | None = None,
    floor: float = 1.0,
    figure: Figure | None = None,
) -> Figure:
    """Error (noise = `floor`) as effects are added one after the other, the start model first."""
    figure = paper_figure(0.3 * len(steps) + 0.75, 4.6, figure)
    axes = figure.add_subplot()
    rungs = range(len(steps))
    axes.plot(fitted, rungs, "o-", ms=4, color=GREY, label="fitted runs", zorder=3)
    if held_out is not None:
        axes.plot(held_out, rungs, "s-", ms=4, color=BLUE, label="held-out runs", zorder=4)
        for rung, number in enumerate(held_out):
            axes.annotate(
                f"{number:.2f}", (number, rung), (0, 5), textcoords="offset points",
                ha="center", color=BLUE, fontsize=7, zorder=5,
            )  # fmt: skip
    axes.axvline(floor, color=INK, lw=0.8, ls=DASHES, label="noise", zorder=2)
    axes.set_xscale("log")
    numbers = [*fitted, *(held_out if held_out is not None else ()), floor]
    axes.set_xlim(min(numbers) / 1.3, max(numbers) * 1.3)
    ticks = [t for t in (0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500) if _within(t, axes)]
    axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
    axes.minorticks_off()
    axes.set_yticks(rungs, [s if i == 0 else f"+ {s}" for i, s in enumerate(steps)])
    axes.set_ylim(len(steps) - 0.6, -0.4)
    axes.set_xlabel("error / noise")
    key_above(axes)
    return figure


def _within(number: float, axes: Axes) -> bool:
    low, high = axes.get_xlim()
    return low <= number <= high
