"""Valve neighbourhood search: switches are moved while the cost falls; switches are counted."""

from __future__ import annotations

import numpy as np

from kemba.model import Model
from kemba.ocp.nlp.ipopt import Iterate
from kemba.ocp.relaxation.schedule import fix, move
from kemba.ocp.relaxation.session import Schedule
from kemba.ocp.relaxation.settings import Ends, ValveSearch
from kemba.trajectory import Trajectory


def search_neighbourhood(
    schedule: Schedule, point: Iterate, rounds: int, best: Iterate | None = None
) -> Iterate:
    """Release every valve switch by a few nodes and round again, at most `rounds` times and as
    long as the cost falls; `best` is a plan that has been through this."""
    longest = schedule.at_most(Ends.current().moved_iterations)
    pays = ValveSearch.current().pays
    for _ in range(rounds):
        better = fix(schedule, Iterate(move(schedule, point).Y), max_iter=longest)
        if not better.solved or (best and better.objective >= (1 - pays) * best.objective):
            break
        point = best = better
    return best or fix(schedule, point)


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
