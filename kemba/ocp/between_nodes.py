"""A joint between the nodes of a plan: on the cubic through its angles and rates there."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from kemba.ocp.phases.modes import OPEN
from kemba.ocp.phases.notes import LETTERS, PHASE
from kemba.trajectory import Array, Trajectory


def course(plan: Trajectory, angle: str, rate: str, clock: Array) -> tuple[Array, Array]:
    """Angles and rates (n,) of a joint at the times `clock` (n,) [s]; constant before and after.

    Nodes hold the rate before an impact there; what it is after the impact follows from the
    parabola through both angles and the next rate. An implicit Euler plan is linear in between.
    """
    t, q, w = plan.time, plan[angle], plan[rate]
    if "phases" not in plan.meta:
        return np.interp(clock, t, q), np.interp(clock, t, w)
    k = np.clip(np.searchsorted(t, clock, side="right") - 1, 0, len(t) - 2)
    h, rise = np.diff(t), np.diff(q)
    begin = w[:-1].copy()
    hit = _impacts(plan)
    begin[hit] = 2 * rise[hit] / h[hit] - w[1:][hit]
    s = np.clip((clock - t[k]) / h[k], 0.0, 1.0)
    a, b = h[k] * begin[k] - rise[k], rise[k] - h[k] * w[k + 1]
    bend = (1 - s) * a + s * b
    angles = q[k] + s * rise[k] + s * (1 - s) * bend
    rates = (rise[k] + (1 - 2 * s) * bend + s * (1 - s) * (b - a)) / h[k]
    inside = (clock >= t[0]) & (clock <= t[-1])
    return angles, np.where(inside, rates, np.interp(clock, t, w))


def _impacts(plan: Trajectory) -> list[int]:
    """The nodes at which a contact or a stop closes, before the last one."""
    phases = [PHASE.fullmatch(str(text)) for text in plan.meta["phases"]]
    found = []
    for before, after in pairwise(m for m in phases if m is not None):
        modes = zip(before[3], after[3], strict=True)
        if any(a == LETTERS[OPEN] != b for a, b in modes):
            found.append(int(after[1]))
    return found
