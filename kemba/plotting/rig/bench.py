"""Figures of one piston on the bench: motion, force and valves in time, force over velocity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

from kemba.errors import KembaError
from kemba.plotting.panels import MILLIMETRES, Panel, Trace, draw_panel
from kemba.plotting.robot.motion import name_sources
from kemba.plotting.source import Mask, Source
from kemba.plotting.style import (
    BLUE,
    GREEN,
    GREY,
    PURPLE,
    VERMILLION,
    key_above,
    paper_figure,
    paper_style,
)
from kemba.trajectory import Array, Trajectory

PANELS = (
    Panel("piston x [mm]", (Trace("piston/x"),), MILLIMETRES),
    Panel("piston v [m/s]", (Trace("piston/v"),)),
    Panel("piston F [N]", (Trace("piston/F"),), height=1.7),
    Panel(
        "pressure P [kPa]",
        (Trace("chamber/extend/P", "extend"), Trace("chamber/retract/P", "retract")),
        1e-3,
        height=1.2,
    ),
    Panel("axis q [m or rad]", (Trace("axis/q"),)),
    Panel("axis tau [N or N.m]", (Trace("axis/tau"),), height=1.7),
    Panel("vessel P [kPa]", (Trace("vessel/P"),), 1e-3, height=1.2),
    Panel("vessel T [K]", (Trace("vessel/T"),), height=1.2),
    Panel(
        "valve",
        (
            Trace("valve/extend", "extend", kind="command"),
            Trace("valve/retract", "retract", kind="command"),
        ),
        height=0.45,
        raster=True,
    ),
)
MODES = {"none": (0, 0), "extend": (1, 0), "retract": (0, 1), "both": (1, 1)}
LOOKS = {
    "extend": (BLUE, "o"),
    "retract": (VERMILLION, "s"),
    "both": (PURPLE, "D"),
    "none": (GREEN, "^"),
}


@paper_style
def plot_bench(sources: Sequence[Source], figure: Figure | None = None) -> Figure:
    """One or several logs of a rig over each other, or a log and what models say of it (Fig. 7).

    Columns that a source lacks drop their trace. Raises KembaError with nothing to draw.
    """
    sources = [_joined(source) for source in sources]
    panels = [panel for panel in PANELS if any(panel.found_in(source) for source in sources)]
    if not panels:
        expected = "columns of the bench log format, such as 'piston/F [N]', were expected"
        raise KembaError(sources[0].name, "has nothing to plot", expected)
    heights = [panel.height for panel in panels]
    figure = paper_figure(sum(heights) + 0.14 * len(heights) + 0.4, figure=figure)
    grid = figure.add_gridspec(len(panels), 1, height_ratios=heights)
    first = None
    for number, panel in enumerate(panels):
        axes = figure.add_subplot(grid[number], sharex=first)
        first = first or axes
        draw_panel(axes, panel, sources, {})
        axes.set_ylabel("" if panel.raster else panel.label)
        axes.tick_params(labelbottom=panel is panels[-1])
    axes.set_xlabel("time [s]")
    figure.align_ylabels()
    if len(sources) > 1:
        name_sources(figure, sources)
    return figure


def _joined(source: Source) -> Source:
    """The source with a vessel's readings joined by lines: its channels are read by turns."""
    log, joined = source.trajectory, {}
    for header, name in zip(log.headers, log.names, strict=True):
        good = np.isfinite(log[name])
        if name.startswith("vessel/") and good.any():
            joined[header] = np.interp(log.time, log.time[good], log[name][good])
    return replace(source, trajectory=log.with_columns(joined)) if joined else source


def valve_modes(trajectory: Trajectory, leg: str = "") -> dict[str, Mask]:
    """Rows (n,) in each of the four modes `none`, `extend`, `retract`, `both`."""
    prefix = f"{leg}/" if leg else ""
    extend, retract = (trajectory[f"{prefix}valve/{side}"] > 0.5 for side in ("extend", "retract"))
    return {
        mode: (extend == bool(on_e)) & (retract == bool(on_r))
        for mode, (on_e, on_r) in MODES.items()
    }


@paper_style
def plot_force_velocity(
    points: Mapping[str, tuple[Array, Array]],
    lines: Mapping[str, tuple[float, float]] | None = None,
    figure: Figure | None = None,
) -> Figure:
    """Steady force over velocity per valve mode (Fig. 6).

    `points`: velocities [m.s-1] and forces [N] by mode, named as in `MODES`; `lines`: force at
    rest [N] and damping [N.s.m-1] of F = F_0 - c v by mode.
    """
    figure = paper_figure(3.0, 4.2, figure)
    axes = figure.add_subplot()
    for mode, (velocity, force) in points.items():
        hue, mark = LOOKS[mode]
        axes.plot(velocity, force, mark, ms=3, mec="none", mfc=hue, alpha=0.7, label=mode, zorder=3)
    for mode, (rest, damping) in (lines or {}).items():
        velocity = points[mode][0]
        ends = np.array([np.nanmin(velocity), np.nanmax(velocity)])
        axes.plot(ends, rest - damping * ends, color=LOOKS[mode][0], zorder=4)
        middle = float(ends.mean())
        axes.annotate(
            f"{rest:.0f} - {damping:.0f} v", (middle, rest - damping * middle),
            (5, -12 if mode == "none" else 5),
            textcoords="offset points", fontsize=7, color=LOOKS[mode][0],
        )  # fmt: skip
    axes.axhline(0.0, color=GREY, lw=0.6)
    axes.set_xlabel("piston v [m/s]")
    axes.set_ylabel("piston F [N]")
    key_above(axes)
    return figure
