"""The figure that suits what is given: a robot's motion, or a bench log."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from kemba.errors import KembaError
from kemba.plotting.rig.bench import plot_bench
from kemba.plotting.robot.machine import machine_of
from kemba.plotting.robot.motion import plot_motion
from kemba.plotting.source import Source


def draw(
    sources: Sequence[Source], model: str | None = None, figure: Figure | None = None
) -> Figure:
    """All sources over each other; `model` as in `machine_of`, for the first of them.

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
