"""Rounded valves without short pulses."""

from __future__ import annotations

import numpy as np


def dwelling(u: np.ndarray, h: np.ndarray, least: float) -> np.ndarray:
    """A rounded valve (nodes + 1,) without pulses shorter than `least` [s]; `h` (nodes,) [s].

    A pulse that is too short is filled in, the shortest first.
    """
    u = np.round(np.clip(u, 0.0, 1.0))
    while True:
        edges = np.flatnonzero(np.diff(u)) + 1
        if len(edges) < 2:
            return u
        ends = np.concatenate([[0.0], np.cumsum(h)])
        spans = ends[edges[1:] - 1] - ends[edges[:-1] - 1]
        i = int(np.argmin(spans))
        if spans[i] >= least - 1e-9:
            return u
        u[edges[i] : edges[i + 1]] = 1.0 - u[edges[i]]
