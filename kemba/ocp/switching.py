"""Valve sequences: moving switches while it pays, and counting them."""

from __future__ import annotations

import numpy as np

from kemba.model import Model
from kemba.ocp.ipopt import Parameters, Point
from kemba.ocp.schedule import FORCES, SWITCHING, TIGHT, VALVE, Search, fix, warm
from kemba.trajectory import Trajectory

REACH = 4  # nodes by which a switch may move at a time
ROUNDS = {True: 2, False: 1}  # half a robot; a whole one takes four times as long
PAYS = 0.02  # relative fall of the cost that makes another round worth while


def polish(search: Search, point: Point) -> Point:
    """Release every valve switch by a few nodes and round again, as long as the cost falls."""
    best: Point | None = None
    for _ in range(ROUNDS[search.transcription.reduction.symmetric]):
        how = {"options": warm(1e-3, tol=1e-3), "free": _release(search, point)}
        parameters = Parameters(TIGHT, VALVE, SWITCHING / 5, forces=FORCES)
        loose = search.solve("move switches", Point(point.Y), parameters, **how)
        better = fix(search, Point(loose.Y))
        if not better.solved or (best and better.objective >= (1 - PAYS) * best.objective):
            break
        point = best = better
    return best or fix(search, point)


def _release(search: Search, point: Point) -> dict[int, tuple[np.ndarray, np.ndarray]]:
    """Bounds of the valve columns: free near their switches, fixed elsewhere."""
    bounds = {}
    for column, u in search.valves(point).items():
        near = np.zeros(len(u), dtype=bool)
        for k in np.flatnonzero(np.diff(u)):
            near[max(k + 1 - REACH, 1) : k + 1 + REACH] = True
        bounds[column] = (np.where(near, 0.0, u), np.where(near, 1.0, u))
    return bounds


def switching(model: Model, plan: Trajectory) -> dict[str, float | int]:
    """How often valves switch in a plan, and the shortest time between two switches of one [s]."""
    count, dwell = 0, np.inf
    for quantity in model.inputs.values():
        if not quantity.binary:
            continue
        at = plan.time[np.flatnonzero(np.diff(plan[quantity.name]))]
        count += len(at)
        dwell = min(dwell, np.diff(at).min(initial=np.inf))
    shortest = float(dwell) if np.isfinite(dwell) else float(plan.time[-1] - plan.time[0])
    return {"switches": count, "shortest_dwell_s": shortest}
