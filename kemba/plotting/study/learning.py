"""The figures of a round of learning: executed and expected, and the error over the rounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from kemba.plotting.style import (
    BLUE,
    DASHES,
    GREY,
    VERMILLION,
    key_above,
    paper_figure,
    paper_style,
)
from kemba.trajectory import Trajectory

SHOWN = (("body/z", "body height [m]", 1.0), ("body/pitch", "pitch [deg]", 180.0 / np.pi))
STYLES = ((DASHES, GREY), ("-", VERMILLION))  # before learning, after it


@paper_style
def plot_executions(
    executed: Sequence[Trajectory],
    expected: Mapping[str, Trajectory],
    planned: Trajectory,
    figure: Figure | None = None,
) -> Figure:
    """Logs over the plan and over what models expect, all by the clock of the plan.

    `expected`: simulations by name, the one before learning first.
    """
    figure = paper_figure(3.6, figure=figure)
    rows = figure.subplots(len(SHOWN), 1, sharex=True)
    for axes, (name, label, factor) in zip(rows, SHOWN, strict=True):
        for i, log in enumerate(executed):
            axes.plot(
                log.time, factor * log[name], color=BLUE, lw=0.8, label="" if i else "executed"
            )
        for (what, motion), (dashes, hue) in zip(expected.items(), STYLES, strict=False):
            axes.plot(motion.time, factor * motion[name], label=what, ls=dashes, color=hue)
        axes.plot(planned.time, factor * planned[name], color="black", lw=0.6, label="planned")
        axes.set_ylabel(label)
    rows[-1].set_xlabel("time of the plan [s]")
    key_above(rows[0])
    return figure


@paper_style
def plot_rounds(
    rounds: Sequence[int],
    apex: Sequence[float],
    expected: tuple[int, float] | None = None,
    figure: Figure | None = None,
) -> Figure:
    """Apex errors [m] of the executed runs by round, and the one `expected` of the next run."""
    figure = paper_figure(2.0, figure=figure)
    axes = figure.add_subplot()
    axes.axhline(0.0, color=GREY, lw=0.6)
    axes.plot(rounds, 1e3 * np.asarray(apex), "o-", color=BLUE, label="executed")
    if expected is not None:
        axes.plot(*(expected[0], 1e3 * expected[1]), "o", mfc="none", color=BLUE, label="expected")
    axes.set_xlabel("run (0: before learning)")
    axes.set_ylabel("apex error [mm]")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    key_above(axes)
    return figure
