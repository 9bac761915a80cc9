"""The figure of repeated executions over their plan: the paper's Fig. 10."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from kemba.plotting.style import COLOURS, SHADE, key_above, paper_figure, paper_style
from kemba.trajectory import Trajectory

BODY = (("body/z", "body height [m]", 1.0), ("body/pitch", "pitch [deg]", 180.0 / np.pi))
ACTUATORS = (("hip/q", "hip [deg]", 180.0 / np.pi), ("piston/x", "piston [mm]", 1e3))


@paper_style
def plot_repeats(
    executed: Sequence[Trajectory],
    planned: Trajectory,
    legs: Sequence[str],
    band: float | None = None,
    figure: Figure | None = None,
) -> Figure:
    """Body and actuators of repeated executions over the plan, all by its clock.

    `band` [m] is drawn about the planned height, as a yardstick. `legs` name the columns.
    """
    figure = paper_figure(2.0 * (2 + len(legs)) / 2, figure=figure)
    grid = figure.subplots(1 + len(legs), 2, sharex=True)
    panels = [(grid[0][j], name, label, factor) for j, (name, label, factor) in enumerate(BODY)]
    for i, leg in enumerate(legs, 1):
        for j, (name, label, factor) in enumerate(ACTUATORS):
            panels.append((grid[i][j], f"{leg}/{name}", f"{leg} {label}", factor))
    for axes, name, label, factor in panels:
        for number, log in enumerate(executed):
            hue = COLOURS[number % len(COLOURS)]
            axes.plot(log.time, factor * log[name], color=hue, lw=0.8, label=f"jump {number + 1}")
        axes.plot(
            planned.time, factor * planned[name], color="black", lw=0.9, ls="--", label="plan"
        )
        axes.set_ylabel(label)
    height = grid[0][0]
    if band is not None:
        z = planned["body/z"]
        told = f"plan ± {100 * band:g} cm"
        height.fill_between(planned.time, z - band, z + band, color=SHADE, label=told, zorder=0)
    for axes in grid[-1]:
        axes.set_xlabel("time of the plan [s]")
    key_above(height)
    return figure
