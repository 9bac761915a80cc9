"""Figures of plans, logs and diagnoses; the only package that uses matplotlib.

Figures are made without pyplot, so they need no display; pass `figure=pyplot.figure()` to a
function to have one that `pyplot.show` opens.

Everything is imported when first asked for: who only reads a log needs no matplotlib.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kemba.plotting.comparison import Band, plot_bands, plot_heat_map, plot_ladder
    from kemba.plotting.motion import (
        draw,
        plot_bench,
        plot_force_velocity,
        plot_motion,
        valve_modes,
    )
    from kemba.plotting.rig import bench_logs, plot_rig
    from kemba.plotting.source import (
        Machine,
        Source,
        default_path,
        load_machine,
        load_source,
        load_sources,
        machine_of,
    )
    from kemba.plotting.sticks import animate, save_animation
    from kemba.plotting.studies import plot_growth, plot_robustness
    from kemba.plotting.style import paper_figure, paper_style, save_figure, svg_text

__all__ = [
    "Band",
    "Machine",
    "Source",
    "animate",
    "bench_logs",
    "default_path",
    "draw",
    "load_machine",
    "load_source",
    "load_sources",
    "machine_of",
    "paper_figure",
    "paper_style",
    "plot_bands",
    "plot_bench",
    "plot_force_velocity",
    "plot_growth",
    "plot_heat_map",
    "plot_ladder",
    "plot_motion",
    "plot_rig",
    "plot_robustness",
    "save_animation",
    "save_figure",
    "svg_text",
    "valve_modes",
]

_HOMES = {  # module -> names that it offers
    "kemba.plotting.comparison": "Band plot_bands plot_ladder plot_heat_map",
    "kemba.plotting.motion": "draw plot_bench plot_force_velocity valve_modes plot_motion",
    "kemba.plotting.rig": "bench_logs plot_rig",
    "kemba.plotting.sticks": "animate save_animation",
    "kemba.plotting.source": "Machine load_machine machine_of "
    "Source default_path load_source load_sources",
    "kemba.plotting.studies": "plot_growth plot_robustness",
    "kemba.plotting.style": "paper_figure paper_style save_figure svg_text",
}


def __getattr__(name: str) -> Any:
    for module, names in _HOMES.items():
        if name in names.split():
            return getattr(import_module(module), name)
    raise AttributeError(f"module 'kemba.plotting' has no attribute '{name}'")
