"""The figure of a comparison: noise ratios by channel and condition."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from kemba.identify.compare import FALSE_DISCOVERIES, Comparison
from kemba.plotting.diagnosis import plot_heat_map

PHASES = ("rest", "stance2", "stance1", "impact", "flight", "moving")


def plot_comparison(found: Comparison) -> Figure:
    """Heat map: channel against phase of motion and valve mode; significant cells are bold."""
    cells = sorted(found.cells, key=lambda c: (_place(c.phase), c.mode))
    conditions = list(dict.fromkeys(f"{c.phase}\n{c.mode}" for c in cells))
    channels = list(dict.fromkeys(c.channel for c in found.cells))
    ratios = np.full((len(channels), len(conditions)), np.nan)
    bold = np.zeros(ratios.shape, bool)
    for cell in cells:
        at = channels.index(cell.channel), conditions.index(f"{cell.phase}\n{cell.mode}")
        ratios[at], bold[at] = cell.ratio, cell.q_value < FALSE_DISCOVERIES
    return plot_heat_map({"": ratios}, channels, conditions, {"": bold})


def _place(phase: str) -> int:
    return PHASES.index(phase) if phase in PHASES else len(PHASES)
