"""Figures of a motion: strip, body, joints, efforts, valves and contact; or of a bench piston."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec
from matplotlib.lines import Line2D
from matplotlib.transforms import ScaledTranslation

from kemba.errors import KembaError
from kemba.plotting.source import Machine, Source, machine_of, stance_spans
from kemba.plotting.sticks import draw_strip, film, strip_height
from kemba.plotting.style import (
    BLUE,
    DEGREES,
    GREEN,
    GREY,
    INK,
    MILLIMETRES,
    PURPLE,
    VERMILLION,
    WIDTH,
    Panel,
    Trace,
    colour,
    draw_panel,
    key_above,
    paper_figure,
    paper_style,
    shade,
    widen,
)
from kemba.trajectory import Array

BODY = (
    Panel("body centre z, x [m]", (Trace("body/z", "z"), Trace("body/x", "x")), least=0.2),
    Panel("pitch θ [deg]", (Trace("body/pitch"),), DEGREES, least=4.0),
)
LEG = (
    Panel("hip q [deg]", (Trace("hip/q"),), DEGREES),
    Panel("piston x [mm]", (Trace("piston/x"),), MILLIMETRES, level="piston/x"),
    Panel("hip τ [N m]", (Trace("hip/tau", kind="command"),), level="hip/tau"),
    Panel(
        "chamber F [N]",
        (Trace("chamber/extend/F", "extend"), Trace("chamber/retract/F", "retract")),
        level="chamber/F",
    ),
    Panel("piston F [N]", (Trace("piston/F"),)),
    Panel(
        "valve",
        (Trace("valve/extend", "extend"), Trace("valve/retract", "retract")),
        height=0.45,
        raster=True,
    ),
    Panel(
        "ground F [N]",
        (Trace("foot/Fz", "normal", kind="force"), Trace("foot/Fx", "along", kind="force")),
    ),
)
STRIP = WIDTH - 0.75  # in, between the labels and the margin
LABEL = 0.42  # in, of an axis' name from the axis, so that numbers such as -1000 fit between


@paper_style
def plot_motion(
    sources: Sequence[Source], machine: Machine, figure: Figure | None = None
) -> Figure:
    """One or several robot motions over each other; the strip shows the first.

    Columns that a source lacks drop their trace, panels that none fills are left out. Grey: the
    leg's foot is on the ground (any foot, in the panels of the body), for the first source.
    `figure`: one to draw into, instead of a new one. Raises KembaError with nothing to draw.
    """
    legs = _legs(sources, machine)
    rows = _rows(sources, legs)
    if not rows:
        expected = "columns of the robot log format, such as 'body/z [m]', were expected"
        raise KembaError(sources[0].name, "has nothing to plot", expected)
    shown = film(sources[0], machine)
    above = [strip_height(shown, machine, STRIP)] if shown else []
    figure, grid = _sheet(figure, rows, above)
    if shown:
        strip = figure.add_subplot(grid[0, :])
        draw_strip(strip, sources[0], machine, shown, STRIP, valves=len(sources) == 1)
    axes = _axes(figure, grid, rows, first=len(above))
    for row, panels in zip(axes, rows, strict=True):
        for ax, panel in zip(row, panels, strict=True):
            draw_panel(ax, panel, sources, machine.limits)
            shade(ax, stance_spans(sources[0], machine, panel.owner))
            widen(ax, panel.least)
    _name_legs(axes, rows, legs)
    name_sources(figure, sources)
    return figure


def _sheet(
    figure: Figure | None, rows: list[list[Panel]], above: Sequence[float] = ()
) -> tuple[Figure, GridSpec]:
    """A figure with room for rows of panels, and for what is `above` them, by its heights [in]."""
    heights = [*above, *(row[0].height for row in rows)]
    figure = paper_figure(sum(heights) + 0.14 * len(heights) + 0.4, figure=figure)
    return figure, figure.add_gridspec(len(heights), max(map(len, rows)), height_ratios=heights)


def name_sources(figure: Figure, sources: Sequence[Source]) -> None:
    """The runs' names with their colours, above everything, where there are several."""
    if len(sources) == 1:
        return
    lines = [Line2D([], [], color=colour(i)) for i in range(len(sources))]
    names = [source.name for source in sources]
    columns = min(4, len(names))
    figure.legend(lines, names, loc="outside upper center", ncols=columns, fontsize=8)


def _legs(sources: Sequence[Source], machine: Machine) -> tuple[str, ...]:
    """The legs of all sources, in the order of the robot."""
    named = {name.split("/")[0] for source in sources for name in source.trajectory.names}
    return tuple(leg for leg in machine.mechanism.legs if leg in named)


def _rows(sources: Sequence[Source], legs: tuple[str, ...]) -> list[list[Panel]]:
    """The panels to draw: the body's side by side, then a column per leg."""
    width = max(1, len(legs))
    body = [panel for panel in BODY if any(panel.found_in(source) for source in sources)]
    rows = [body[i : i + width] for i in range(0, len(body), width)]
    for panel in LEG:
        row = [panel.on(leg) for leg in legs]
        if any(cell.found_in(source) for cell in row for source in sources):
            rows.append(row)
    return rows


def _axes(
    figure: Figure, grid: GridSpec, rows: list[list[Panel]], first: int = 0
) -> list[list[Axes]]:
    """Axes that share their time, and in a leg's row their numbers."""
    table: list[list[Axes]] = []
    for number, panels in enumerate(rows):
        row: list[Axes] = []
        for column, panel in enumerate(panels):
            alike = row[0] if row and panel.label == panels[0].label else None
            above = table[0][0] if table else row[0] if row else None
            end = column + 1 if panel is not panels[-1] else None  # the last one fills the row
            place = grid[first + number, column:end]
            row.append(figure.add_subplot(place, sharex=above, sharey=alike))
        table.append(row)
    return table


def _name_legs(axes: list[list[Axes]], rows: list[list[Panel]], legs: tuple[str, ...] = ()) -> None:
    """Labels at the outer edges only, and each leg's name above its column."""
    named = False
    for number, (row, panels) in enumerate(zip(axes, rows, strict=True)):
        ofleg = panels[0].owner in legs
        for column, (ax, panel) in enumerate(zip(row, panels, strict=True)):
            inner = ofleg and column > 0
            ax.tick_params(labelleft=not inner, labelbottom=number == len(rows) - 1)
            ax.set_ylabel("" if inner or panel.raster else panel.label)
            if ofleg and not named:
                ax.set_title(f"{legs[column]} leg", loc="left", fontweight="bold", color=INK)
        named = named or ofleg
    for ax in axes[-1]:
        ax.set_xlabel("time [s]")
    figure = axes[0][0].get_figure()
    if figure is not None:
        beside = ScaledTranslation(-LABEL, 0.0, figure.dpi_scale_trans)
        for row in axes:  # `align_ylabels` would lay out everything to find the place
            row[0].yaxis.set_label_coords(0.0, 0.5, transform=row[0].transAxes + beside)


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
    rows = [[panel] for panel in PANELS if any(panel.found_in(source) for source in sources)]
    if not rows:
        expected = "columns of the bench log format, such as 'piston/F [N]', were expected"
        raise KembaError(sources[0].name, "has nothing to plot", expected)
    figure, grid = _sheet(figure, rows)
    axes = _axes(figure, grid, rows)
    for (ax,), (panel,) in zip(axes, rows, strict=True):
        draw_panel(ax, panel, sources, {})
    _name_legs(axes, rows)
    name_sources(figure, sources)
    return figure


def _joined(source: Source) -> Source:
    """The source with a vessel's readings joined by lines: its channels are read by turns."""
    log, joined = source.trajectory, {}
    for header, values in log.columns.items():
        good = np.isfinite(values)
        if header.startswith("vessel/") and good.any():
            joined[header] = np.interp(log.time, log.time[good], values[good])
    return replace(source, trajectory=log.with_columns(joined)) if joined else source


@paper_style
def plot_force_velocity(
    points: Mapping[str, tuple[Array, Array]],
    lines: Mapping[str, tuple[float, float]] | None = None,
    figure: Figure | None = None,
) -> Figure:
    """Steady force over velocity per valve mode (Fig. 6).

    `points`: velocities [m.s-1] and forces [N] by mode, named as in `LOOKS`; `lines`: force at
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


def draw(
    sources: Sequence[Source], model: str | None = None, figure: Figure | None = None
) -> Figure:
    """All `sources` over each other; `model` as in `machine_of`, for the first of them; `figure`:
    where they are drawn, a new one without it.

    Raises KembaError when bench and robot logs are mixed, or have nothing to plot.
    """
    bench = [source for source in sources if source.bench]
    if not bench:
        return plot_motion(sources, machine_of(sources[0], model), figure)
    if len(bench) < len(sources):
        robot = next(source for source in sources if not source.bench)
        hint = f"'{bench[0].name}' is a bench log; plot the two kinds one after the other"
        raise KembaError(robot.name, "is a robot's motion", hint=hint)
    return plot_bench(sources, figure)
