"""The figure that suits what is given: a robot's motion, or a bench log."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from kemba.errors import KembaError
from kemba.plotting.bench import plot_bench
from kemba.plotting.machine import load_machine
from kemba.plotting.motion import plot_motion
from kemba.plotting.source import Source


def draw(
    sources: Sequence[Source], model: str = "planning", figure: Figure | None = None
) -> Figure:
    """All sources over each other; `model` (a path or shipped) has the robot and its limits.

    Raises KembaError when bench and robot logs are mixed, or have nothing to plot.
    """
    bench = [source for source in sources if source.bench]
    if not bench:
        return plot_motion(sources, load_machine(model), figure)
    if len(bench) < len(sources):
        robot = next(source for source in sources if not source.bench)
        hint = f"'{bench[0].name}' is a bench log; plot the two kinds one after the other"
        raise KembaError(robot.name, "is a robot's motion", hint=hint)
    return plot_bench(sources, figure)
