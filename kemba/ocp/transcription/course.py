"""A motion between the nodes of a plan: cubics through coordinates and rates at both ends."""

import re
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np

from kemba.trajectory import Array

# a phase in the sidecar: its nodes, the mode of every contact and stop, every valve
PHASE = re.compile(r"(\d+)-(\d+) ([ohab]*) ([01]*)")
OPENED = "o"  # of the modes


def cubic(q0: Any, q1: Any, way0: Any, way1: Any, share: Any) -> Any:
    """A coordinate at a `share` of an interval with q0 and q1 at its ends. `way0`, `way1`: its
    rates there, times the duration."""
    rise, left = q1 - q0, 1 - share
    return q0 + share * rise + share * left * (left * (way0 - rise) + share * (rise - way1))


def begin_ways(meta: Mapping[str, Any], q: Array, way0: Array, way1: Array) -> Array:
    """Rates at the begin of intervals, times their durations (n, ...), of coordinates q (n + 1,
    ...) at the nodes of a plan with the sidecar `meta`.

    `way0`, `way1`: those of the nodes at both ends. Nodes hold the rate before an impact there;
    what it is after the impact follows from the parabola through both coordinates and the next
    rate. An implicit Euler plan is linear in between.
    """
    rise = np.diff(q, axis=0)
    if "phases" not in meta:
        return np.asarray(rise)
    begin: Array = way0.copy()
    hit = _impacts(meta)
    begin[hit] = 2 * rise[hit] - way1[hit]
    return begin


def _impacts(meta: Mapping[str, Any]) -> list[int]:
    """The nodes at which a contact or a stop closes, before the last one."""
    phases = [PHASE.fullmatch(str(text)) for text in meta["phases"]]
    found = []
    for before, after in pairwise(m for m in phases if m is not None):
        modes = zip(before[3], after[3], strict=True)
        if any(a == OPENED != b for a, b in modes):
            found.append(int(after[1]))
    return found
