"""The clock of a log against that of the plan it executes: by the valve commands of both."""

import numpy as np

from kemba.trajectory import Array, Trajectory


def in_plans_clock(log: Trajectory, table: Trajectory) -> Trajectory:
    """The log with plan time 0 at 0 s; `table`: the commands that were sent (controller.csv).

    The valve commands of both are laid over each other: the median of the differences of all
    edges, or of the first of each valve where their numbers differ. A log without valve commands
    begins with the table.
    """
    sent = table.time + start_of(table) - table.time[0]
    pairs = [
        pair
        for name in table.names
        if "valve/" in name and name in log
        for pair in _pairs(rises(log.time, log[name]), rises(sent, table[name]))
    ]
    shift = float(np.median([b - a for a, b in pairs])) if pairs else sent[0] - log.time[0]
    return log.at_times(log.time + shift)


def start_of(table: Trajectory) -> float:
    """Plan time [s] at which a controller table begins: valves are sent the dead time early."""
    return -float(table.meta.get("lead", -table.time[0]))


def rises(time: Array, command: Array) -> Array:
    """When [s] a valve is switched on; one that is on in the first row counts."""
    on = np.nan_to_num(command) > 0.5
    return np.asarray(time[np.flatnonzero(np.diff(on.astype(int), prepend=0) > 0)])


def _pairs(found: Array, sent: Array) -> list[tuple[float, float]]:
    """Edges that belong together; only the first where one side has more than the other."""
    count = len(found) if len(found) == len(sent) else min(1, len(found), len(sent))
    return list(zip(found[:count].tolist(), sent[:count].tolist(), strict=True))
