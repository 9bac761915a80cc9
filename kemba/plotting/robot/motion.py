"""The figure of a motion: film strip, body, joints, efforts, valves and contact."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec
from matplotlib.lines import Line2D
from matplotlib.transforms import ScaledTranslation

from kemba.errors import KembaError
from kemba.plotting.panels import DEGREES, MILLIMETRES, Panel, Trace, draw_panel, shade, widen
from kemba.plotting.robot.machine import Machine, stance_spans
from kemba.plotting.robot.strip import draw_strip, film, strip_height
from kemba.plotting.source import Source
from kemba.plotting.style import INK, WIDTH, colour, paper_figure, paper_style

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
    heights = [row[0].height for row in rows]
    if shown:
        heights.insert(0, strip_height(shown, machine, STRIP))
    figure = paper_figure(sum(heights) + 0.14 * len(heights) + 0.4, figure=figure)
    grid = figure.add_gridspec(len(heights), max(map(len, rows)), height_ratios=heights)
    if shown:
        strip = figure.add_subplot(grid[0, :])
        draw_strip(strip, sources[0], machine, shown, STRIP, valves=len(sources) == 1)
    axes = _axes(figure, grid, rows, first=int(bool(shown)))
    for row, panels in zip(axes, rows, strict=True):
        for ax, panel in zip(row, panels, strict=True):
            draw_panel(ax, panel, sources, machine.limits)
            shade(ax, stance_spans(sources[0], machine, panel.owner))
            widen(ax, panel.least)
    _name_legs(axes, rows, legs)
    if len(sources) > 1:
        name_sources(figure, sources)
    return figure


def name_sources(figure: Figure, sources: Sequence[Source]) -> None:
    """The runs' names with their colours, above everything."""
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


def _axes(figure: Figure, grid: GridSpec, rows: list[list[Panel]], first: int) -> list[list[Axes]]:
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


def _name_legs(axes: list[list[Axes]], rows: list[list[Panel]], legs: tuple[str, ...]) -> None:
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
