"""Trajectories in a row."""

from collections.abc import Sequence

import numpy as np

from kemba.trajectory import Trajectory

AHEAD = ("body/x", "foot/x", "hip/x", "knee/x")  # what a motion before has moved on


def joined(parts: Sequence[Trajectory]) -> Trajectory:
    """Trajectories in a row, each from where the one before ends: in time and in place.

    Their first and last states agree; of both the earlier is kept. Columns are those of the first.
    """
    first = parts[0]
    time, columns = [first.time], {name: [first[name]] for name in first.names}
    phases = list(first.meta.get("phases", ()))
    end, x, nodes = float(first.time[-1]), float(first["body/x"][-1]), len(first) - 1
    for part in parts[1:]:
        time.append(part.time[1:] - part.time[0] + end)
        on = x - float(part["body/x"][0])
        for name, values in columns.items():
            values.append(part[name][1:] + on * name.endswith(AHEAD))
        phases += [_later(str(text), nodes) for text in part.meta.get("phases", ())]
        end, x = float(time[-1][-1]), float(columns["body/x"][-1][-1])
        nodes += len(part) - 1
    whole = dict(zip(first.headers, map(np.concatenate, columns.values()), strict=True))
    meta = {**first.meta, **({"phases": phases} if phases else {})}
    return Trajectory(np.concatenate(time), whole, meta)


def _later(phase: str, nodes: int) -> str:
    """A phase of the sidecar, `12-18 ho 10`, some nodes later."""
    span, rest = phase.split(" ", 1)
    first, last = span.split("-")
    return f"{int(first) + nodes}-{int(last) + nodes} {rest}"
