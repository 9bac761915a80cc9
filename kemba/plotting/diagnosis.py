"""Figures for comparing and identifying: heat map, estimates with bands, ladder of errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from kemba.plotting.panels import shade
from kemba.plotting.style import (
    BLACK,
    BLUE,
    DASHES,
    GREY,
    INK,
    SHADE,
    VERMILLION,
    key_above,
    paper_figure,
    paper_style,
)
from kemba.trajectory import Array

FLOOR, CEILING = 1.0, 30.0  # error ratios between which the heat map changes its colour


@paper_style
def plot_heat_map(
    tables: Mapping[str, Any],
    channels: Sequence[str],
    conditions: Sequence[str],
    significant: Mapping[str, Any] | None = None,
    label: str = "error / noise",
    figure: Figure | None = None,
) -> Figure:
    """Error ratios by channel and condition; 1 is the noise floor, NaN was never visited.

    `tables`: arrays (channels, conditions) by title, such as `before` and `after`, one below the
    other on one colour scale. `significant`: arrays of the same shape; these numbers are bold.
    """
    rows = len(channels) * len(tables)
    figure = paper_figure(0.24 * rows + 0.45 * len(tables) + 0.75, figure=figure)
    grid = figure.subplots(len(tables), 1, squeeze=False, sharex=True)[:, 0]
    for axes, (title, values) in zip(grid, tables.items(), strict=True):
        bold = (significant or {}).get(title, np.zeros(np.shape(values), bool))
        image = _heat(axes, np.asarray(values, dtype=float), np.asarray(bold))
        axes.set_title(title if len(tables) > 1 else "", loc="left", fontweight="bold")
        axes.set_yticks(range(len(channels)), channels)
        axes.set_xticks(range(len(conditions)), conditions)
    bar = figure.colorbar(image, ax=list(grid), extend="both", pad=0.01, aspect=12 * len(tables))
    bar.set_label(label)
    ticks = [1, 3, 10, 30]
    bar.set_ticks(ticks, labels=[str(t) for t in ticks])
    bar.minorticks_off()
    return figure


def _heat(axes: Axes, values: Array, bold: np.ndarray[Any, Any]) -> Any:
    shown = np.ma.masked_invalid(np.maximum(values, 1e-6))
    norm = LogNorm(FLOOR, CEILING)
    image = axes.imshow(shown, norm=norm, cmap="YlOrBr", aspect="auto", interpolation="nearest")
    axes.patch.set(facecolor="white", edgecolor=SHADE, hatch="////")
    axes.grid(visible=False)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    for (row, column), value in np.ndenumerate(values):
        if np.isfinite(value):
            light = norm(value) > 0.6
            axes.text(
                column,
                row,
                f"{value:.1f}" if value < 99.5 else f"{value:.0f}",
                ha="center",
                va="center",
                fontsize=7,
                color="white" if light else BLACK,
                fontweight="bold" if bold[row, column] else "normal",
            )
    return image


@dataclass(frozen=True)
class Band:
    """An estimate in time (n,) with the `low` and `high` ends of its interval.

    `explained`: what an effect on trial makes of it; `stance`: spans [s] to shade.
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
        shade(axes, band.stance)
        axes.axhline(0.0, color=GREY, lw=0.6, zorder=1)
        axes.fill_between(
            band.time, band.low, band.high, color=BLUE, alpha=0.25, lw=0, label="95 %", zorder=2
        )
        axes.plot(band.time, band.estimate, color=BLUE, label="estimate", zorder=3)
        if band.explained is not None:
            axes.plot(
                band.time, band.explained, color=VERMILLION, ls=DASHES, label=explained, zorder=4
            )
        axes.set_ylabel(band.label)
        axes.margins(x=0)
    key_above(grid[0])
    grid[-1].set_xlabel("time [s]")
    figure.align_ylabels()
    return figure


@paper_style
def plot_ladder(
    steps: Sequence[str],
    fitted: Sequence[float],
    held_out: Sequence[float] | None = None,
    floor: float = 1.0,
    figure: Figure | None = None,
) -> Figure:
    """Error (noise = `floor`) as effects are added one after the other, the start model first."""
    figure = paper_figure(0.26 * len(steps) + 0.75, 4.6, figure)
    axes = figure.add_subplot()
    rungs = range(len(steps))
    axes.plot(fitted, rungs, "o-", ms=4, color=GREY, label="fitted runs", zorder=3)
    if held_out is not None:
        axes.plot(held_out, rungs, "s-", ms=4, color=BLUE, label="held-out runs", zorder=4)
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
