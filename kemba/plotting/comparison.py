"""The figure of a comparison, one page: where the error is, how much force is missing in time, and
what that force goes with.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure, FigureBase, SubFigure

from kemba.identify.compare.bins import MODES, PHASES, ConditionBin, order_of
from kemba.identify.compare.compare import Comparison
from kemba.identify.compare.force_profiles import ForceProfile
from kemba.identify.compare.words import owner
from kemba.identify.problem.problem import MissingForce
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
    shade,
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
def plot_bands(bands: Sequence[Band], explained: str = "explained") -> Figure:
    """Estimates such as the missing force d(t), one panel each, with bands and a line at zero."""
    figure = paper_figure(0.95 * len(bands) + 0.55)
    _bands(figure, bands, explained)
    return figure


def _bands(room: FigureBase, bands: Sequence[Band], explained: str = "explained") -> None:
    grid = room.subplots(len(bands), 1, squeeze=False, sharex=True)[:, 0]
    for axes, band in zip(grid, bands, strict=True):
        draw_band(axes, band, explained)
    key_above(grid[0])
    grid[-1].set_xlabel("time [s]")
    room.align_ylabels()


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
    steps: Sequence[str], fitted: Sequence[float], unseen: Sequence[float], kept: str
) -> Figure:
    """Error / noise as effects are added one after the other, the start model first. `kept`: what
    the errors `unseen` are of."""
    figure = paper_figure(0.3 * len(steps) + 0.75, 4.6)
    axes = figure.add_subplot()
    rungs = range(len(steps))
    axes.plot(fitted, rungs, "o-", ms=4, color=GREY, label="fitted runs", zorder=3)
    axes.plot(unseen, rungs, "s-", ms=4, color=BLUE, label=kept, zorder=4)
    for rung, number in enumerate(unseen):
        axes.annotate(
            f"{number:.2f}", (number, rung), (0, 5), textcoords="offset points",
            ha="center", color=BLUE, fontsize=7, zorder=5,
        )  # fmt: skip
    axes.axvline(1.0, color=INK, lw=0.8, ls=DASHES, label="noise", zorder=2)
    axes.set_xscale("log")
    numbers = [*fitted, *unseen, 1.0]
    axes.set_xlim(min(numbers) / 1.3, max(numbers) * 1.3)
    low, high = axes.get_xlim()
    ticks = [t for t in (0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500) if low <= t <= high]
    axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
    axes.minorticks_off()
    axes.set_yticks(rungs, [s if i == 0 else f"+ {s}" for i, s in enumerate(steps)])
    axes.set_ylim(len(steps) - 0.6, -0.4)
    axes.set_xlabel("error / noise")
    key_above(axes)
    return figure


HEAT = "error / noise (bold: significant)"
FLOOR, CEILING = 1.0, 30.0  # error ratios between which the heat map changes its colour
TICKS = (1, 3, 10, 30)
ROW, LEVEL = 0.19, 0.13  # in, height of a channel and of a line of labels
Condition = tuple[str, ...]  # its levels, the outermost first


def add_bar(figure: FigureBase, image: Any, grid: Sequence[Axes]) -> None:
    """The colour scale beside the tables."""
    bar = figure.colorbar(image, ax=list(grid), extend="both", pad=0.01, aspect=12 * len(grid))
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
                in_layout=False,  # inside its cell: half of the time of a layout
            )
    return image


def name_conditions(axes: Axes, levels: Sequence[Condition]) -> None:
    """Labels below the columns; outer levels are written once for all that they span."""
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


WIDEST = 26  # columns of one heat map; more are shown in two, one below the other
CLOSE = 14  # columns above which there is room for the first letters of words only
BANDS = 3
Column = tuple[str, str, str]  # phase, mode, region


@paper_style
def plot_comparison(found: Comparison) -> Figure:
    """Heat map by condition (significant bins bold); d(t) with its 95 % band in the run that
    lacks most; the missing force against what it goes with."""
    tables = columns_of(found.bins)
    bands = bands_of(found.missing)
    panels = panels_of(found.force_profiles)
    parts = [heat_height(found.bins, tables), 0.85 * len(bands) + 0.35, 1.75 if panels else 0.0]
    figure = paper_figure(sum(parts))
    rooms = figure.subfigures(3, 1, height_ratios=[max(p, 0.01) for p in parts], squeeze=False)
    heat, time, force = rooms[:, 0]
    draw_heat_maps(heat, {HEAT: found.bins}, tables)
    if bands:
        _bands(time, bands)
        time.axes[0].set_title("missing force", loc="left")
    _profiles(force, panels)
    return figure


def columns_of(listed: Sequence[ConditionBin]) -> list[list[Column]]:
    """The conditions that were visited, in one table or, when there are many, in two."""
    order = sorted({(c.phase, c.mode, c.region) for c in listed}, key=order_of)
    if len(order) <= WIDEST:
        return [order]
    half = len(order) / 2
    cuts = [i for i in range(1, len(order)) if order[i][0] != order[i - 1][0]] or [int(half)]
    cut = min(cuts, key=lambda i: abs(i - half))
    return [order[:cut], order[cut:]]


def in_words(columns: Sequence[Column]) -> list[tuple[str, ...]]:
    """The labels of columns: phase on up to two lines, open valves, place in the stroke."""
    modes = {m: w[:3] if len(columns) > CLOSE else w for m, w in MODES.items()}
    found: list[tuple[str, ...]] = []
    for phase, mode, region in columns:
        words = PHASES.get(phase, phase)
        head, _, last = words.rpartition(" ")
        labels = (f"{head}\n{last}" if len(head) > 2 else words, modes.get(mode, mode), region)
        found.append(labels if any(column[2] for column in columns) else labels[:2])
    return found


def heat_height(listed: Sequence[ConditionBin], tables: Sequence[list[Column]]) -> float:
    """Inches that the heat maps of these bins need."""
    return (len(channels_of(listed)) * ROW + 4 * LEVEL + 0.3) * len(tables)


def channels_of(listed: Sequence[ConditionBin]) -> list[str]:
    """The channels of bins, a row each."""
    return list(dict.fromkeys(c.channel for c in listed))


def draw_heat_maps(
    room: FigureBase,
    groups: Mapping[str, Sequence[ConditionBin]],
    tables: Sequence[list[Column]],
) -> None:
    """Error ratios by channel and condition, of every group of bins by its title, one below the
    other on one colour scale: 1 is the noise floor, bold is significant."""
    channels = channels_of([one for listed in groups.values() for one in listed])
    shown = [(title, columns) for title in groups for columns in tables]
    grid = room.subplots(len(shown), 1, squeeze=False)[:, 0]
    for axes, (title, columns) in zip(grid, shown, strict=True):
        image = draw_heat(axes, *heat_table(groups[title], channels, columns))
        axes.set_title(title if columns is tables[0] else "", loc="left")
        axes.set_yticks(range(len(channels)), channels)
        name_conditions(axes, in_words(columns))
    if len(channels) * len(shown) > 3:  # there is no room for a scale beside one row
        add_bar(room, image, list(grid))


def heat_table(
    listed: Sequence[ConditionBin], channels: Sequence[str], columns: Sequence[Column]
) -> tuple[Array, np.ndarray[Any, Any]]:
    """Error ratios (channels, columns), NaN where there is no bin, and which are significant."""
    known = {(c.channel, (c.phase, c.mode, c.region)): c for c in listed}
    ratios = np.full((len(channels), len(columns)), np.nan)
    bold = np.zeros(ratios.shape, bool)
    for at in np.ndindex(ratios.shape):
        one = known.get((channels[at[0]], columns[at[1]]))
        if one is not None:
            ratios[at], bold[at] = one.ratio, one.significant
    return ratios, bold


def bands_of(missing: Sequence[MissingForce], after: Sequence[MissingForce] = ()) -> list[Band]:
    """d(t) of the channels that lack most, in the run that lacks most; with `after`, the part of
    it that is gone there counts as explained."""
    if not missing:
        return []
    at = int(np.argmax([float(np.max(m.evidence())) for m in missing]))
    worst = missing[at]
    order = np.argsort(-worst.evidence())[:BANDS]
    low, high = worst.band()
    found = []
    for k in sorted(order.tolist()):
        label = f"{owner(worst.channels[k])}\nd [{worst.units[k]}]"
        own = (worst.force[:, k], low[:, k], high[:, k])
        explained = worst.force[:, k] - after[at].force[:, k] if after else None
        found.append(Band(label, worst.time, *own, explained, worst.stance))
    return found


def panels_of(found: Sequence[ForceProfile]) -> list[ForceProfile]:
    """Of the force channel that lacks most: its quantities, and the command that explains most."""
    own = [profile for profile in found if profile.channel == found[0].channel]
    sent = [profile for profile in own if profile.quantity.startswith("after ")]
    best = max(sent, key=lambda profile: profile.gain, default=None)
    return [profile for profile in own if profile not in sent or profile is best]


def _profiles(room: SubFigure, panels: Sequence[ForceProfile]) -> None:
    if not panels:
        return
    grid = room.subplots(1, len(panels), squeeze=False)[0]
    for axes, profile in zip(grid, panels, strict=True):
        _profile(axes, profile)
    first = panels[0]
    grid[0].set_ylabel(f"missing on the {first.channel} [{first.unit}]")


def _profile(axes: Axes, profile: ForceProfile) -> None:
    """Force per bin with 95 % intervals; unsure bins do not stretch the axis."""
    axes.axhline(0.0, color=GREY, lw=0.6, zorder=1)
    spread: Array = 1.96 * profile.sigma
    axes.errorbar(
        profile.centre, profile.force, spread, fmt="o-", ms=3, lw=0.8, elinewidth=0.8, capsize=1.5,
        color=BLUE, zorder=3,
    )  # fmt: skip
    sure = spread <= 4.0 * np.median(spread)
    reach = 1.15 * float(np.max(np.abs(profile.force[sure]) + spread[sure]))
    axes.set_ylim(-reach, reach)
    axes.set_xlabel(profile.quantity)
