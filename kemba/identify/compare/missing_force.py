"""The force that a model lacks, in time, with its 95 % band: where it stands out most."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kemba.identify.problem.problem import Array, MissingForce


@dataclass(frozen=True)
class Peak:
    """The largest force that one channel lacks: where, how much, its 95 % interval."""

    channel: str
    unit: str
    run: str
    time_s: float
    value: float
    low: float
    high: float
    rms: float


def peaks(found: list[MissingForce]) -> list[Peak]:
    """Per channel the moment at which the missing force stands out most from its band."""
    chosen = []
    for k, channel in enumerate(found[0].channels):
        clear = [np.max(np.abs(m.force[:, k]) / m.sigma[:, k]) for m in found]
        m = found[int(np.argmax(clear))]
        i = int(np.argmax(np.abs(m.force[:, k]) / m.sigma[:, k]))
        value, spread = float(m.force[i, k]), 1.96 * float(m.sigma[i, k])
        rms = float(np.sqrt(np.mean(np.concatenate([m.force[:, k] for m in found]) ** 2)))
        at = float(m.time[i])
        chosen.append(
            Peak(channel, m.units[k], m.run, at, value, value - spread, value + spread, rms)
        )
    return chosen


def spans(time: Array, flags: Array) -> tuple[tuple[float, float], ...]:
    """Intervals [s] in which `flags` (n,) holds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    last = len(time) - 1
    return tuple(
        (float(time[a]), float(time[min(b, last)])) for a, b in edges.reshape(-1, 2).tolist()
    )
