"""Panels against time: which columns they hold, and how each is drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from kemba.plotting.source import Source
from kemba.plotting.style import BLUE, DASHES, GREY, INK, SHADE, VERMILLION, colour, key_above

DEGREES = 180 / np.pi
MILLIMETRES = 1e3


@dataclass(frozen=True)
class Trace:
    """One column in a panel.

    A `command` is drawn as steps; a `force` of contact as steps in plans, where its row stands
    for the whole interval before it, and as a line where it was sampled.
    """

    name: str
    label: str = ""
    kind: Literal["state", "command", "force"] = "state"


@dataclass(frozen=True)
class Panel:
    """Columns that share an axis; the first is solid, the second dashed.

    Numbers are multiplied by `factor` into the unit of `label`. `raster` draws 0/1 columns as
    bars, one row each; `level` is the key of the limits to show, `least` the smallest span of
    the axis, so that rounding errors are not magnified into motion.
    """

    label: str
    traces: tuple[Trace, ...]
    factor: float = 1.0
    height: float = 0.78
    raster: bool = False
    level: str = ""
    least: float = 0.0

    def on(self, leg: str) -> Panel:
        """The same panel for one leg."""
        at = tuple(replace(t, name=f"{leg}/{t.name}" if leg else t.name) for t in self.traces)
        return replace(self, traces=at)

    @property
    def owner(self) -> str:
        """The leg, or `body`."""
        return self.traces[0].name.split("/")[0]

    def found_in(self, source: Source) -> bool:
        """Whether the source has anything to show here."""
        return any(trace.name in source.trajectory for trace in self.traces)


def draw_panel(
    axes: Axes, panel: Panel, sources: Sequence[Source], limits: Mapping[str, Sequence[float]]
) -> None:
    """Every source's traces in one axes, with limits as dashed lines and a key above."""
    for level in limits.get(panel.level, ()):
        axes.axhline(level * panel.factor, color=GREY, lw=0.7, ls=DASHES, zorder=1.5, gid="limit")
    axes.margins(x=0)
    if panel.raster:
        _raster(axes, panel, sources)
        return
    for number, source in enumerate(sources):
        for place, trace in enumerate(panel.traces):
            if trace.name in source.trajectory:
                look = _look(number, place, len(sources))
                _line(axes, source, trace, panel.factor, look)
    if len(panel.traces) > 1:
        _key(axes, panel, sources)


def widen(axes: Axes, least: float) -> None:
    """Give the y axis at least the span `least` around its middle."""
    low, high = axes.get_ylim()
    if high - low < least:
        axes.set_ylim((low + high - least) / 2, (low + high + least) / 2)


def _look(number: int, place: int, sources: int) -> dict[str, Any]:
    """Colours mark runs and dashes mark traces; with a single run colours mark traces."""
    dashes = "-" if place == 0 else DASHES
    if sources == 1:
        return {"color": (BLUE, VERMILLION)[place % 2], "linestyle": dashes}
    return {"color": colour(number), "linestyle": dashes}


def _line(axes: Axes, source: Source, trace: Trace, factor: float, look: dict[str, Any]) -> None:
    steps = trace.kind == "command" or (trace.kind == "force" and source.plan)
    values = source.held(trace.name) if steps else source.trajectory[trace.name]
    style = "default" if not steps else "steps-pre" if source.plan else "steps-post"
    look = {"drawstyle": style, "zorder": 3, "gid": trace.name, **look}
    axes.plot(source.trajectory.time, factor * values, **look)


def _key(axes: Axes, panel: Panel, sources: Sequence[Source]) -> None:
    shown = [t for t in panel.traces if any(t.name in s.trajectory for s in sources)]
    for trace in shown:
        look = _look(0, panel.traces.index(trace), len(sources))
        look["color"] = look["color"] if len(sources) == 1 else INK
        axes.add_line(Line2D([], [], label=trace.label, **look))
    key_above(axes)


def _raster(axes: Axes, panel: Panel, sources: Sequence[Source]) -> None:
    """One row of bars per trace, a lane in it per source."""
    rows, lane = len(panel.traces), 0.64 / len(sources)
    for row, trace in enumerate(panel.traces):
        for number, source in enumerate(sources):
            if trace.name not in source.trajectory:
                continue
            spans = source.spans(np.asarray(source.trajectory[trace.name] > 0.5))
            bars = [(start, end - start) for start, end in spans]
            bottom = rows - 1 - row + 0.32 - lane * (number + 1)
            face = _look(number, row, len(sources))["color"]
            axes.broken_barh(bars, (bottom, lane), facecolor=face, lw=0, zorder=3, gid=trace.name)
    axes.set_yticks(range(rows), [trace.label for trace in reversed(panel.traces)])
    axes.set_ylim(-0.5, rows - 0.5)
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)


def shade(axes: Axes, spans: Sequence[tuple[float, float]]) -> None:
    """Grey bands over the whole height, behind everything."""
    bars = [(start, end - start) for start, end in spans]
    whole = axes.get_xaxis_transform()
    axes.broken_barh(bars, (0, 1), transform=whole, fc=SHADE, lw=0, zorder=0, gid="stance")
