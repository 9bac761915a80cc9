"""A locked chamber filling and venting, after the paper's Fig. 3 and 4."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kemba.plant.characterise import Rise, dead_times
from kemba.plotting.style import BLUE, GREY, INK, VERMILLION, key_above, paper_figure, paper_style

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
