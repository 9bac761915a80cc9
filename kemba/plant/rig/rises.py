"""Force rise and fall of a locked chamber: dead time and time constants (eq. 4 and 5)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.plant.rig.estimate import Estimate, linear, mean
from kemba.plant.stepping.arrays import Array
from kemba.trajectory import Trajectory

STILL = 2e-4  # m; a rod that moves less is locked
STEP_SIZE = 20.0  # N; smaller steps of the force tell nothing
ONSET = (0.02, 0.10)  # shares of the step through which its beginning is extrapolated


@dataclass(frozen=True)
class Rise:
    """One switching of one chamber of a locked rod.

    `u`: the valve's new value; `x` [m]: the chamber's own extension, of `stroke` [m] at most;
    `time` [s] from the command and `level` (n,) from 0 to 1 along the step; `dead` [s]; `plateau`
    [N] the steady force of the chamber when full.
    """

    u: float
    x: float
    stroke: float
    supply: float
    chamber: str
    time: Array
    level: Array
    dead: float
    plateau: float

    def fit(self, dead: float) -> tuple[float, Array]:
        """Time constant [s] of the first-order answer after `dead`, and the fitted levels."""
        from scipy.optimize import least_squares

        late = np.clip(self.time - dead, 0.0, None)
        begin = max(float(np.interp(1 - np.exp(-1), self.level, late)), 1e-4)
        found = least_squares(
            lambda p: p[1] * (1.0 - np.exp(-late / abs(p[0]))) - self.level, [begin, 1.0]
        )
        tau, full = abs(float(found.x[0])), float(found.x[1])
        return tau, full * (1.0 - np.exp(-late / tau))


@dataclass(frozen=True)
class RiseTable:
    """Table I: time constants [s] at both valve states and both ends, dead times [s]."""

    fill: tuple[Estimate, Estimate]
    vent: tuple[Estimate, Estimate]
    dead: dict[str, Estimate]
    r2: float
    r2_linear: float


def find_rises(log: Trajectory, stroke: float) -> Iterator[Rise]:
    """Every switching of a chamber in a bench log of a cylinder of `stroke` [m], while the rod is
    locked."""
    x = log["piston/x"]
    if np.ptp(x) > STILL:
        return
    valves = {name: log[f"valve/{name}"] > 0.5 for name in ("extend", "retract")}
    edges = {name: np.flatnonzero(np.diff(v.astype(int))) + 1 for name, v in valves.items()}
    every = np.sort(np.concatenate([*edges.values()]))
    for chamber, indices in edges.items():
        sign, own = (1.0, x) if chamber == "extend" else (-1.0, stroke - x)
        for edge in indices:
            later = every[every > edge]
            stop = int(later[0]) if len(later) else len(log)
            u = float(valves[chamber][edge])
            rise = _rise(log, int(edge), stop, sign, chamber)
            if rise is not None:
                yield Rise(u=u, x=float(own.mean()), stroke=stroke, **rise)


def _rise(
    log: Trajectory, edge: int, stop: int, sign: float, chamber: str
) -> dict[str, Any] | None:
    """The answer to the switching at row `edge`, until row `stop`; None where it tells nothing."""
    force, time = sign * log["piston/F"], log.time[edge - 1 : stop] - log.time[edge]
    before = float(force[max(edge - 20, 0) : edge].mean())
    after = float(force[stop - max((stop - edge) // 10, 3) : stop].mean())
    if abs(after - before) < STEP_SIZE or stop - edge < 20:
        return None
    level = (force[edge - 1 : stop] - before) / (after - before)
    low, high = (_crossing(time, level, share) for share in ONSET)
    dead = low - (high - low) * ONSET[0] / (ONSET[1] - ONSET[0])
    supply = float(log.meta.get("supply", 0.7e6))
    return {
        "supply": supply,
        "chamber": chamber,
        "time": time,
        "level": level,
        "dead": dead,
        "plateau": max(before, after),
    }


def _crossing(time: Array, level: Array, share: float) -> float:
    """The first time [s] at which the level passes `share`, interpolated."""
    i = max(int(np.argmax(level > share)), 1)
    return float(np.interp(share, level[i - 1 : i + 1], time[i - 1 : i + 1]))


def dead_times(rises: Iterable[Rise]) -> dict[str, Estimate]:
    """Dead times [s] of switching `on` and `off`, as far as the tests have them."""
    found: dict[str, list[float]] = {}
    for rise in rises:
        found.setdefault("on" if rise.u else "off", []).append(rise.dead)
    return {name: mean(np.array(values)) for name, values in found.items()}


def rise_table(rises: Iterable[Rise]) -> RiseTable:
    """Dead times and the bilinear time constants of eq. 5. Raises KembaError on too few tests."""
    rises = list(rises)
    if {r.u for r in rises} != {0.0, 1.0} or len({round(r.x, 4) for r in rises}) < 2:
        raise KembaError(
            "characterise",
            "the locked tests do not cover filling and venting at two positions",
            "tests as in configs/rigs/locked.yaml were expected",
        )
    dead = dead_times(rises)
    fits = [r.fit(dead["on" if r.u else "off"].value) for r in rises]
    taus = np.array([tau for tau, _ in fits])
    level = np.concatenate([r.level for r in rises])
    error = np.concatenate([fitted for _, fitted in fits]) - level
    r2 = 1.0 - float(error @ error) / float(((level - level.mean()) ** 2).sum())
    u, x = np.array([r.u for r in rises]), np.array([r.x / r.stroke for r in rises])
    corners = np.array([[1, a, b, a * b] for a in (1.0, 0.0) for b in (0.0, 1.0)])
    table, r2_linear = linear(np.column_stack([np.ones_like(u), u, x, u * x]), taus, corners)
    return RiseTable((table[0], table[1]), (table[2], table[3]), dead, r2, r2_linear)
