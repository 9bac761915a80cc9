"""Figures of bench logs as the paper draws its rig."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kemba.effects import Effect
from kemba.errors import KembaError
from kemba.model.model import NOMINAL_SUPPLY
from kemba.plant.characterise import (
    Rise,
    Stroke,
    agreement,
    dead_times,
    find_rises,
    find_stroke,
    predict,
    stroke_table,
)
from kemba.plant.rigs import bench_model
from kemba.plotting.motion import LOOKS, PANELS, plot_force_velocity
from kemba.plotting.source import PLAN_FILE, Source
from kemba.plotting.style import (
    BLUE,
    GREY,
    INK,
    VERMILLION,
    draw_panel,
    key_above,
    paper_figure,
    paper_style,
)
from kemba.trajectory import Trajectory

SHOWN = 0.2  # s after the command
STATES = ((1.0, "filling", BLUE), (0.0, "venting", VERMILLION))


@paper_style
def plot_rises(rises: Sequence[Rise], figure: Figure | None = None) -> Figure:
    """Normalised force after a command at the ends of the stroke (Fig. 3), with the first-order
    answer of each group of tests dashed."""
    figure = paper_figure(2.6, figure=figure)
    supplies = sorted({rise.supply for rise in rises})
    for axes, (u, state, _) in zip(_pair(figure), STATES, strict=True):
        own = [rise for rise in rises if rise.u == u]
        for rise in own:
            hue = colormaps["viridis"](0.15 + 0.3 * supplies.index(rise.supply))
            axes.plot(1e3 * rise.time, _force(rise), color=hue, lw=0.8, alpha=0.6)
        for supply in supplies:
            hue = colormaps["viridis"](0.15 + 0.3 * supplies.index(supply))
            axes.plot([], [], color=hue, label=f"{supply / 1e6:.1f} MPa")
        _fits(axes, own, dead_times(rises)["on" if u else "off"].value)
        axes.set_title(state, loc="left")
        key_above(axes)
    return figure


@paper_style
def plot_volumes(rises: Sequence[Rise], figure: Figure | None = None) -> Figure:
    """The same at several volumes (Fig. 4), and how the rise time grows with the volume."""
    figure = paper_figure(2.6, figure=figure)
    left, middle, right = figure.subplots(1, 3)
    dead = dead_times(rises)
    places = sorted({_place(rise) for rise in rises})
    for axes, (u, state, hue) in zip((left, middle), STATES, strict=True):
        own = [rise for rise in rises if rise.u == u]
        for rise in own:
            shown = colormaps["viridis"](0.9 * _place(rise) / rise.stroke)
            axes.plot(1e3 * rise.time, _force(rise), color=shown, lw=1.0)
        _label(axes, state)
        x = np.array([_place(rise) for rise in own])
        taus = np.array([1e3 * rise.fit(dead["on" if u else "off"].value)[0] for rise in own])
        line = np.polynomial.Polynomial.fit(x, taus, 1)
        error = np.sum((taus - line(x)) ** 2) / max(np.sum((taus - taus.mean()) ** 2), 1e-12)
        right.plot(1e3 * x, taus, "o", ms=4, color=hue)
        ends = np.array([places[0], places[-1]])
        right.plot(1e3 * ends, line(ends), color=hue, label=f"{state}, R² {1 - error:.3f}")
    for place in places:
        shown = colormaps["viridis"](0.9 * place / rises[0].stroke)
        left.plot([], [], color=shown, label=f"{place / rises[0].stroke:.0%}")
    left.legend(title="volume", loc="lower right")
    right.set_xlabel("extension [mm]")
    right.set_ylabel("rise time [ms]")
    right.set_ylim(bottom=0.0)
    key_above(right, 1)
    return figure


def _pair(figure: Figure) -> tuple[Axes, Axes]:
    left, right = figure.subplots(1, 2, sharey=True)
    _label(left)
    _label(right)
    right.set_ylabel("")
    return left, right


def _label(axes: Axes, state: str = "") -> None:
    axes.set_title(state, loc="left")
    axes.set_xlim(-5.0, 1e3 * SHOWN)
    axes.set_xlabel("time after the command [ms]")
    axes.set_ylabel("force / steady force")
    axes.axvline(0.0, color=GREY, lw=0.6)


def _force(rise: Rise) -> np.ndarray:
    """The normalised force: rising when filling, falling when venting."""
    return rise.level if rise.u else 1.0 - rise.level


def _fits(axes: Axes, rises: Sequence[Rise], dead: float) -> None:
    """The first-order answer at each place, with its mean time constant, dashed."""
    told = ["dashed: first order"]
    for x in sorted({_place(rise) for rise in rises}):
        group = [rise for rise in rises if _place(rise) == x]
        tau = float(np.mean([rise.fit(dead)[0] for rise in group]))
        time = np.linspace(dead, SHOWN, 300)
        level = 1.0 - np.exp(-(time - dead) / tau)
        values = level if group[0].u else 1.0 - level
        axes.plot(1e3 * time, values, "--", color=INK, lw=0.9, zorder=4)
        told.append(f"{1e3 * x:.0f} mm: {1e3 * tau:.1f} ms")
    side = ("bottom", 0.08) if rises and rises[0].u else ("top", 0.92)
    axes.text(
        0.97, side[1], "\n".join(told), ha="right", va=side[0], fontsize=7,
        transform=axes.transAxes,
    )  # fmt: skip


def _place(rise: Rise) -> float:
    """Extension [m] to half a millimetre, without the sensor's noise."""
    return abs(round(2e3 * rise.x) / 2e3)


Logs = Mapping[str, Trajectory]


def bench_logs(folder: Path) -> dict[str, Trajectory]:
    """The bench logs in a folder by name; empty where there are none, or other files too."""
    if (folder / PLAN_FILE).is_file():
        return {}
    found = {path.stem: Trajectory.read(path) for path in sorted(folder.glob("*.csv"))}
    return found if all(log.meta.get("kind") == "bench" for log in found.values()) else {}


def plot_rig(
    logs: Logs,
    model: str = "planning",
    effects: Sequence[Effect] | None = None,
    figure: Figure | None = None,
) -> Figure:
    """The paper's figure of a data set of one rig: locked chamber, five volumes, dynamometer, or
    random motion, the last beside what `effects`, else those of `model`, predict.

    Raises KembaError when the logs are none of these.
    """
    cylinder = bench_model(model, NOMINAL_SUPPLY).mechanism.need_cylinder()
    rises = [rise for log in logs.values() for rise in find_rises(log, cylinder.stroke)]
    strokes = [s for s in map(find_stroke, logs.values()) if s is not None]
    if rises and strokes:
        hint = "plot the folder of each rig by itself"
        raise KembaError(next(iter(logs)), "logs of several rigs cannot share a figure", hint=hint)
    if rises:
        several = len({round(rise.x, 3) for rise in rises}) > 2
        return (plot_volumes if several else plot_rises)(rises, figure)
    if strokes:
        return plot_strokes(strokes, figure)
    name, log = _nominal(logs)
    supply = float(log.meta.get("supply", NOMINAL_SUPPLY))
    listed = bench_model(model, supply).effects if effects is None else tuple(effects)
    return plot_prediction(log, predict(cylinder, listed, log), name, figure)


def plot_strokes(strokes: Sequence[Stroke], figure: Figure | None = None) -> Figure:
    """Force over speed by valve mode with straight fits (Fig. 6), at the nominal supply."""
    supplies = {s.supply for s in strokes if s.supply > 0.0} or {0.0}
    supply = min(supplies, key=lambda p: abs(p - NOMINAL_SUPPLY))
    shown = [s for s in strokes if s.supply in (supply, 0.0)]
    own = {mode: [s for s in shown if s.mode == mode] for mode in LOOKS}
    points = {
        mode: (np.array([s.speed for s in group]), np.array([s.force for s in group]))
        for mode, group in own.items()
        if group
    }
    lines = {line.mode: (line.F_static.value, line.c_d.value) for line in stroke_table(shown)}
    return plot_force_velocity(points, lines, figure)


@paper_style
def plot_prediction(
    log: Trajectory, predicted: Trajectory, name: str = "full model", figure: Figure | None = None
) -> Figure:
    """The force of a log and what a simpler model predicts for its motion and valves (Fig. 7)."""
    r2, rms = agreement(predicted, log)
    sources = [Source(name, log), Source("approximate model", predicted)]
    force, valves = (p for p in PANELS if p.label in ("piston F [N]", "valve"))
    figure = paper_figure(2.9, figure=figure)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=[4, 1])
    draw_panel(top, force, sources, {})
    for line, source in zip(top.lines, sources, strict=True):
        line.set(label=source.name, linewidth=0.9)
    top.lines[1].set_linestyle((0, (3.2, 1.4)))
    top.set_ylabel(force.label)
    top.set_title(f"R² {r2:.3f}, RMS {rms:.1f} N", loc="left")
    key_above(top)
    draw_panel(bottom, valves, sources[:1], {})
    bottom.set_xlabel("time [s]")
    return figure


def _nominal(logs: Logs) -> tuple[str, Trajectory]:
    """The log nearest to the nominal supply. Raises KembaError where none moves."""
    moving = {n: log for n, log in logs.items() if np.ptp(log["piston/x"]) > 1e-3}
    if not moving:
        expected = "logs as kemba-opt simulate writes them for a rig were expected"
        raise KembaError(next(iter(logs), "bench"), "shows no test of a known rig", expected)

    def off(item: tuple[str, Trajectory]) -> float:
        return abs(float(item[1].meta.get("supply", NOMINAL_SUPPLY)) - NOMINAL_SUPPLY)

    return min(moving.items(), key=off)
