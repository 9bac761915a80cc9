"""The figure of a plan executed under many conditions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from kemba.plotting.style import BLUE, GREY, VERMILLION, key_above, paper_figure, paper_style
from kemba.trajectory import Array


@paper_style
def plot_robustness(
    apex: Array,
    landed: Array,
    ranks: Mapping[str, Mapping[str, float | None]],
    planned: float | None = None,
    figure: Figure | None = None,
) -> Figure:
    """How high executions went and which landed, and which conditions matter.

    `apex` (m,) [m] and `landed` (m,) of every execution; `ranks`: rank correlations by condition,
    each with `landing` and `apex`, None where there is none; `planned` [m] is marked.
    """
    figure = paper_figure(max(2.0, 0.7 + 0.3 * len(ranks)), figure=figure)
    left, right = figure.subplots(1, 2)
    good = np.asarray(landed, dtype=bool)
    edges = np.histogram_bin_edges(apex, bins="auto")
    groups = {
        f"landed ({good.sum()})": (good, BLUE),
        f"fell ({(~good).sum()})": (~good, VERMILLION),
    }
    shown = [(label, apex[rows], hue) for label, (rows, hue) in groups.items() if rows.any()]
    left.hist(
        [values for _, values, _ in shown],
        edges,
        stacked=True,
        label=[label for label, _, _ in shown],
        color=[hue for _, _, hue in shown],
    )
    if planned is not None:
        left.axvline(planned, color=GREY, ls="--", label="plan")
    left.set_xlabel("apex [m]")
    left.set_ylabel("executions")
    key_above(left)
    order = sorted(ranks, key=lambda name: _size(ranks[name]))
    for answer, hue, shift in (("landing", VERMILLION, 0.2), ("apex", BLUE, -0.2)):
        lengths: Sequence[float] = [ranks[name].get(answer) or 0.0 for name in order]
        right.barh(np.arange(len(order)) + shift, lengths, 0.36, color=hue, label=answer)
    right.axvline(0.0, color=GREY, lw=0.6)
    right.set_yticks(range(len(order)), order)
    right.set_xlim(-1.0, 1.0)
    right.set_xlabel("rank correlation")
    key_above(right)
    return figure


def _size(found: Mapping[str, float | None]) -> float:
    """By what conditions are sorted: landing first."""
    return 2 * abs(found.get("landing") or 0.0) + abs(found.get("apex") or 0.0)


@paper_style
def plot_growth(
    sizes: Array,
    seconds: Mapping[str, Array],
    exponents: Mapping[str, float],
    figure: Figure | None = None,
) -> Figure:
    """Solve times [s] over numbers of nodes by task, with fitted powers of N."""
    figure = paper_figure(3.0, 4.2, figure)
    axes = figure.add_subplot()
    for index, (name, times) in enumerate(seconds.items()):
        hue = (BLUE, VERMILLION)[index % 2]
        exponent = exponents[name]
        axes.loglog(sizes, times, "o", ms=4, color=hue, label=f"{name}: N^{exponent:.2f}")
        level = np.exp(np.mean(np.log(times) - exponent * np.log(sizes)))
        axes.loglog(sizes, level * np.asarray(sizes, dtype=float) ** exponent, color=hue)
    axes.set_xticks(sizes, [str(size) for size in sizes], minor=False)
    axes.minorticks_off()
    axes.set_xlabel("nodes N")
    axes.set_ylabel("solve time [s]")
    key_above(axes)
    return figure
