"""Heat maps of error ratios: channels down, conditions across, numbers in the cells."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure, FigureBase

from kemba.plotting.style import BLACK, INK, SHADE, paper_figure, paper_style
from kemba.trajectory import Array

FLOOR, CEILING = 1.0, 30.0  # error ratios between which the heat map changes its colour
TICKS = (1, 3, 10, 30)
ROW, LEVEL = 0.19, 0.13  # in, height of a channel and of a line of labels
Condition = str | tuple[str, ...]  # of several levels: the outermost first


@paper_style
def plot_heat_map(
    tables: Mapping[str, Any],
    channels: Sequence[str],
    conditions: Sequence[Condition],
    significant: Mapping[str, Any] | None = None,
    label: str = "error / noise",
    figure: Figure | None = None,
) -> Figure:
    """Error ratios by channel and condition; 1 is the noise floor, NaN was never visited.

    `tables`: arrays (channels, conditions) by title, such as `before` and `after`, one below the
    other on one colour scale. `significant`: arrays of the same shape; these numbers are bold.
    """
    each = heat_height(len(channels), conditions)
    figure = paper_figure(each * len(tables) + 0.3, figure=figure)
    grid = figure.subplots(len(tables), 1, squeeze=False)[:, 0]
    for axes, (title, values) in zip(grid, tables.items(), strict=True):
        bold = (significant or {}).get(title, np.zeros(np.shape(values), bool))
        image = draw_heat(axes, np.asarray(values, dtype=float), np.asarray(bold))
        axes.set_title(title if len(tables) > 1 else "", loc="left", fontweight="bold")
        axes.set_yticks(range(len(channels)), channels)
        name_conditions(axes, conditions)
    add_bar(figure, image, list(grid), label)
    return figure


def heat_height(channels: int, conditions: Sequence[Condition]) -> float:
    """Inches that one table needs."""
    names = [(c,) if isinstance(c, str) else c for c in conditions]
    levels = max(len(c) + sum(name.count("\n") for name in c) for c in names)
    return ROW * channels + LEVEL * levels + 0.3


def add_bar(figure: FigureBase, image: Any, grid: Sequence[Axes], label: str) -> None:
    """The colour scale beside the tables."""
    bar = figure.colorbar(image, ax=list(grid), extend="both", pad=0.01, aspect=12 * len(grid))
    bar.set_label(label)
    bar.set_ticks(TICKS, labels=[str(t) for t in TICKS])
    bar.minorticks_off()


def draw_heat(axes: Axes, values: Array, bold: np.ndarray[Any, Any]) -> Any:
    """One table of ratios (channels, conditions) with its numbers; hatched where never visited."""
    shown = np.ma.masked_invalid(np.maximum(values, 1e-6))
    norm = LogNorm(FLOOR, CEILING)
    image = axes.imshow(shown, norm=norm, cmap="YlOrBr", aspect="auto", interpolation="nearest")
    axes.patch.set(facecolor="white", edgecolor=SHADE, hatch="////")
    axes.grid(visible=False)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    size = 7.0 if values.shape[1] <= 20 else 6.0
    for (row, column), value in np.ndenumerate(values):
        if np.isfinite(value):
            light = norm(value) > 0.6
            axes.text(
                column,
                row,
                f"{value:.1f}" if value < 9.95 else f"{value:.0f}",
                ha="center",
                va="center",
                fontsize=size,
                color="white" if light else BLACK,
                fontweight="bold" if bold[row, column] else "normal",
            )
    return image


def name_conditions(axes: Axes, conditions: Sequence[Condition]) -> None:
    """Labels below the columns; outer levels are written once for all that they span."""
    levels = [(c,) if isinstance(c, str) else c for c in conditions]
    deep = len(levels[0])
    axes.set_xticks(range(len(levels)), [c[-1] for c in levels])
    for level in range(deep - 1):
        outer = [c[: level + 1] for c in levels]
        starts = [i for i, c in enumerate(outer) if not i or c != outer[i - 1]]
        for start, end in zip(starts, [*starts[1:], len(levels)], strict=True):
            down = -4.0 - 72.0 * LEVEL * (deep - 1 - level)
            axes.annotate(
                levels[start][level],
                ((start + end - 1) / 2, 0.0),
                (0.0, down),
                xycoords=axes.get_xaxis_transform(),
                textcoords="offset points",
                ha="center",
                va="top",
                fontsize=7,
                fontweight="bold" if level == 0 else "normal",
            )
            if start:
                line = ("white", 0.6) if level else (INK, 0.8)
                axes.axvline(start - 0.5, color=line[0], lw=line[1])
