"""Bench figures, and the figures of comparing and identifying."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Annotation

from kemba.errors import KembaError
from kemba.identify.compare.bins import ConditionBin
from kemba.plotting import draw
from kemba.plotting.comparison import (
    Band,
    columns_of,
    draw_heat_maps,
    name_conditions,
    plot_bands,
    plot_ladder,
)
from kemba.plotting.motion import plot_bench, plot_force_velocity
from kemba.plotting.source import Source
from kemba.trajectory import Trajectory

TIME = np.linspace(0.0, 1.0, 101)


def bench(name: str, scale: float = 1.0) -> Source:
    """A bench log whose force is scaled, as from another model."""
    columns = {
        "piston/x [m]": 0.035 + 0.03 * np.sin(6 * TIME),
        "piston/F [N]": scale * 300 * np.sin(6 * TIME),
        "valve/extend [1]": TIME > 0.3,
        "valve/retract [1]": (TIME > 0.2) & (TIME < 0.4),
    }
    return Source(name, Trajectory(TIME, columns))


def test_bench_logs_have_their_own_figure() -> None:
    figure = draw([bench("full"), bench("approximate", 0.9)])
    assert [axes.get_ylabel() for axes in figure.axes] == ["piston x [mm]", "piston F [N]", ""]
    force = [line for line in figure.axes[1].lines if line.get_gid() == "piston/F"]
    assert len({line.get_color() for line in force}) == 2
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["full", "approximate"]


def test_bench_and_robot_do_not_mix(plan: Source) -> None:
    with pytest.raises(KembaError, match="plan: is a robot's motion; 'full' is a bench log"):
        draw([plan, bench("full")])
    with pytest.raises(KembaError, match="nothing to plot"):
        plot_bench([Source("odd", Trajectory(TIME, {"wind [m.s-1]": TIME}))])


def test_force_over_velocity() -> None:
    v = np.linspace(-0.5, 0.5, 11)
    modes = {"extend": (324.0, 97.0), "none": (0.0, 25.0)}
    points = {mode: (v, rest - c * v) for mode, (rest, c) in modes.items()}
    axes = plot_force_velocity(points, modes).axes[0]
    fitted = np.asarray(axes.lines[2].get_ydata())
    np.testing.assert_allclose(fitted, [324 + 48.5, 324 - 48.5])
    assert axes.get_legend_handles_labels()[1] == ["extend", "none"]


def heat(ratio: float, q: float = 1.0, **place: str) -> ConditionBin:
    """A bin of a comparison, with a place that does not matter unless it is given."""
    known = {"channel": "body/z [m]", "phase": "rest", "mode": "00", "region": "", **place}
    return ConditionBin(**known, ratio=ratio, q_value=q)


def test_heat_map_tells_its_numbers() -> None:
    before = [heat(1.0), heat(45.0, 0.0, phase="flight"), heat(130.0, channel="hip/q [rad]")]
    after = [heat(1.1, phase=one.phase, channel=one.channel) for one in before]
    figure = Figure()
    draw_heat_maps(figure, {"before": before, "after": after}, columns_of(before))
    first, second, _ = figure.axes
    assert first.get_title("left") == "before"
    shown = [text for text in first.texts if not isinstance(text, Annotation)]
    assert [text.get_text() for text in shown] == ["1.0", "45", "130"]
    assert [text.get_fontweight() for text in shown] == ["normal", "bold", "normal"]
    assert [label.get_text() for label in first.get_yticklabels()] == ["body/z [m]", "hip/q [rad]"]
    assert sum(not isinstance(text, Annotation) for text in second.texts) == 3


def test_conditions_of_several_levels_are_named_once() -> None:
    axes = Figure().add_subplot()
    name_conditions(axes, [("flight", "00", "in"), ("flight", "00", "out"), ("flight", "10", "in")])
    assert [label.get_text() for label in axes.get_xticklabels()] == ["in", "out", "in"]
    outer = {t.get_text(): t.xy[0] for t in axes.texts if isinstance(t, Annotation)}
    assert outer == {"flight": 1.0, "00": 0.5, "10": 2.0}


def test_bands_show_estimate_and_explanation() -> None:
    d = np.sin(6 * TIME)
    bands = [
        Band("front rod d [N]", TIME, d, d - 1, d + 1, 0.9 * d, [(0.0, 0.2)]),
        Band("rear rod d [N]", TIME, d, d - 1, d + 1),
    ]
    figure = plot_bands(bands, "seal friction")
    names = figure.axes[0].get_legend_handles_labels()[1]
    assert sorted(names) == ["95 %", "estimate", "seal friction"]
    assert [axes.get_ylabel() for axes in figure.axes] == [band.label for band in bands]
    assert len(figure.axes[0].collections[0].get_paths()) == 1


def test_ladder_goes_down_effect_by_effect() -> None:
    figure = plot_ladder(["planning", "supply_droop"], [8.0, 1.1], [9.0, 1.3], "left-out runs")
    (axes,) = figure.axes
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert names == ["planning", "+ supply_droop"]
    assert axes.yaxis_inverted()
    assert axes.get_legend_handles_labels()[1] == ["fitted runs", "left-out runs", "noise"]
    assert [text.get_text() for text in axes.texts] == ["9.00", "1.30"]
