"""The figure of a comparison, one page: where the error is, how much force is missing in time, and
what that force goes with."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from kemba.identify.compare.bins import MODES, PHASES, ConditionBin
from kemba.identify.compare.compare import Comparison
from kemba.identify.compare.force_profiles import ForceProfile
from kemba.identify.problem.types import MissingForce
from kemba.plotting.bands import Band, draw_band
from kemba.plotting.heat import LEVEL, ROW, add_bar, draw_heat, name_conditions
from kemba.plotting.style import BLUE, GREY, key_above, paper_figure, paper_style
from kemba.trajectory import Array

REGIONS = ("", "in", "mid", "out")
WIDEST = 26  # columns of one heat map; more are shown in two, one below the other
CLOSE = 14  # columns above which there is room for the first letters of words only
BANDS = 3
Column = tuple[str, str, str]  # phase, mode, region


@paper_style
def plot_comparison(found: Comparison, figure: Figure | None = None) -> Figure:
    """Heat map by condition (significant bins bold); d(t) with its 95 % band in the run that
    lacks most; the missing force against what it goes with."""
    tables = columns_of(found.bins)
    bands = bands_of(found.missing)
    panels = panels_of(found.force_profiles)
    channels = list(dict.fromkeys(c.channel for c in found.bins))
    heights = [len(channels) * ROW + 4 * LEVEL + 0.3] * len(tables)
    parts = [sum(heights), 0.85 * len(bands) + 0.35, 1.75 if panels else 0.0]
    figure = paper_figure(sum(parts), figure=figure)
    rooms = figure.subfigures(3, 1, height_ratios=[max(p, 0.01) for p in parts], squeeze=False)
    heat, time, force = rooms[:, 0]
    _heat(heat, found.bins, channels, tables)
    _bands(time, bands)
    _profiles(force, panels)
    return figure


def columns_of(listed: Sequence[ConditionBin]) -> list[list[Column]]:
    """The conditions that were visited, in one table or, when there are many, in two."""
    order = sorted({(c.phase, c.mode, c.region) for c in listed}, key=place_of)
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


def place_of(column: Column) -> tuple[int, str, int]:
    """Sort key of a column: place of its phase, valve mode, place of its region."""
    phase, mode, region = column
    return (
        list(PHASES).index(phase) if phase in PHASES else len(PHASES),
        mode,
        REGIONS.index(region),
    )


def _heat(
    room: SubFigure,
    listed: Sequence[ConditionBin],
    channels: Sequence[str],
    tables: list[list[Column]],
) -> None:
    known = {(c.channel, (c.phase, c.mode, c.region)): c for c in listed}
    grid = room.subplots(len(tables), 1, squeeze=False)[:, 0]
    for axes, columns in zip(grid, tables, strict=True):
        ratios = np.full((len(channels), len(columns)), np.nan)
        bold = np.zeros(ratios.shape, bool)
        for at in np.ndindex(ratios.shape):
            one = known.get((channels[at[0]], columns[at[1]]))
            if one is not None:
                ratios[at], bold[at] = one.ratio, one.significant
        image = draw_heat(axes, ratios, bold)
        axes.set_yticks(range(len(channels)), channels)
        name_conditions(axes, in_words(columns))
    grid[0].set_title("error / noise (bold: significant)", loc="left")
    if len(channels) * len(tables) > 3:  # there is no room for a scale beside one row
        add_bar(room, image, list(grid), "")


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
        label = f"{_owner(worst.channels[k])}\nd [{worst.units[k]}]"
        own = (worst.force[:, k], low[:, k], high[:, k])
        explained = worst.force[:, k] - after[at].force[:, k] if after else None
        found.append(Band(label, worst.time, *own, explained, worst.stance))
    return found


def _owner(channel: str) -> str:
    if channel == "piston/F":
        return "rod"
    return channel.replace("piston/x", "rod").replace("hip/q", "hip").replace("/", " ")


def _bands(room: SubFigure, bands: Sequence[Band]) -> None:
    if not bands:
        return
    grid = room.subplots(len(bands), 1, squeeze=False, sharex=True)[:, 0]
    for axes, band in zip(grid, bands, strict=True):
        draw_band(axes, band)
    key_above(grid[0])
    grid[0].set_title("missing force", loc="left")
    grid[-1].set_xlabel("time [s]")
    room.align_ylabels()


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
