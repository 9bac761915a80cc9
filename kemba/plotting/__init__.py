"""Figures of plans, logs and diagnoses; the only package that uses matplotlib.

Figures are made without pyplot, so they need no display; pass `figure=pyplot.figure()` to a
function to have one that `pyplot.show` opens.

Everything is imported when first asked for: who only reads a log needs no matplotlib.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kemba.plotting.motion import draw
    from kemba.plotting.rig import bench_logs, plot_rig
    from kemba.plotting.source import load_sources

__all__ = ["bench_logs", "draw", "load_sources", "plot_rig"]

_HOMES = {"draw": "motion", "load_sources": "source", "bench_logs": "rig", "plot_rig": "rig"}


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(f"kemba.plotting.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'kemba.plotting' has no attribute '{name}'")
