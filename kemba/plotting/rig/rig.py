"""The figures of bench data sets, after the paper's Fig. 3, 4, 6 and 7."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from kemba.effects import Effect
from kemba.errors import KembaError
from kemba.plant.characterise import (
    Stroke,
    agreement,
    find_rises,
    find_stroke,
    predict,
    stroke_table,
)
from kemba.plant.rigs import bench_model
from kemba.plotting.panels import draw_panel
from kemba.plotting.rig.bench import LOOKS, PANELS, plot_force_velocity
from kemba.plotting.rig.locked import plot_rises, plot_volumes
from kemba.plotting.source import PLAN_FILE, Source
from kemba.plotting.style import key_above, paper_figure, paper_style
from kemba.trajectory import Trajectory

NOMINAL = 0.7e6  # Pa; the pressure at which one figure is drawn of several
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
    cylinder = bench_model(model, NOMINAL).mechanism.need_cylinder()
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
    supply = float(log.meta.get("supply", NOMINAL))
    listed = bench_model(model, supply).effects if effects is None else tuple(effects)
    return plot_prediction(log, predict(cylinder, listed, log), name, figure)


def plot_strokes(strokes: Sequence[Stroke], figure: Figure | None = None) -> Figure:
    """Force over speed by valve mode with straight fits (Fig. 6), at the nominal supply."""
    supplies = {s.supply for s in strokes if s.supply > 0.0} or {0.0}
    supply = min(supplies, key=lambda p: abs(p - NOMINAL))
    shown = [s for s in strokes if s.supply in (supply, 0.0)]
    modes = [mode for mode in LOOKS if any(s.mode == mode for s in shown)]
    points = {
        mode: (
            np.array([s.speed for s in shown if s.mode == mode]),
            np.array([s.force for s in shown if s.mode == mode]),
        )
        for mode in modes
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
    chosen = [PANELS[2], PANELS[4]]
    figure = paper_figure(2.9, figure=figure)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=[4, 1])
    draw_panel(top, chosen[0], sources, {})
    for line, source in zip(top.lines, sources, strict=True):
        line.set(label=source.name, linewidth=0.9)
    top.lines[1].set_linestyle((0, (3.2, 1.4)))
    top.set_ylabel(chosen[0].label)
    top.set_title(f"R² {r2:.3f}, RMS {rms:.1f} N", loc="left")
    key_above(top)
    draw_panel(bottom, chosen[1], sources[:1], {})
    bottom.set_xlabel("time [s]")
    return figure


def _nominal(logs: Logs) -> tuple[str, Trajectory]:
    """The log nearest to the nominal supply. Raises KembaError where none moves."""
    moving = {n: log for n, log in logs.items() if np.ptp(log["piston/x"]) > 1e-3}
    if not moving:
        expected = "logs as kemba-opt simulate writes them for a rig were expected"
        raise KembaError(next(iter(logs), "bench"), "shows no test of a known rig", expected)
    return min(moving.items(), key=lambda item: abs(float(item[1].meta.get("supply", NOMINAL))
                                                    - NOMINAL))  # fmt: skip
