"""The plan as a table for the robot's 1 kHz controller (paper, IV-B).

Valve edges come on its ticks one after the other, so that impulses keep.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor

import numpy as np

from kemba.model import Model
from kemba.model.rest import moving_start
from kemba.ocp.transcription.course import begin_ways, cubic
from kemba.trajectory import Array, Trajectory

SNAP = 1e-6  # ticks; an edge this near to a tick is on it


@dataclass(frozen=True)
class ValveEdges:
    """A valve's edges in ticks, ascending, the first one opens. `leg`: the one it drives; `force`:
    the way it pushes, +1 or -1."""

    edges: Sequence[float]
    leg: int
    force: float


def rounded(valves: Sequence[ValveEdges]) -> list[list[int]]:
    """The tick of every edge of every valve: as a rule the one before or the one after it.

    An edge that comes a tick late adds or takes one tick of its chamber's force. In order of time,
    each goes to the tick after which its leg has been pushed too much by the least impulse (error
    feedback): so pulses and gaps keep their lengths, and a chamber on one side of a piston makes up
    for the other. Edges keep their order, also between valves, and those of one valve stay a tick
    apart.
    """
    wanted = [_apart(valve.edges) for valve in valves]
    order = sorted((time, v, k) for v, edges in enumerate(wanted) for k, time in enumerate(edges))
    ticks: list[list[int]] = [[] for _ in valves]
    excess = dict.fromkeys((valve.leg for valve in valves), 0.0)  # impulse, in ticks of a chamber
    earlier, before, latest = -1, -1.0, -1  # latest tick of the times before this one, this one
    for time, v, k in order:
        if time > before + SNAP:
            earlier, before = max(earlier, latest), time
        sign = valves[v].force * (-1.0 if k % 2 == 0 else 1.0)  # opening late takes, closing adds
        low = max(earlier, ticks[v][-1] + 1 if ticks[v] else 0)
        around = {max(low, floor(time + SNAP)), max(low, ceil(time - SNAP))}
        leg = valves[v].leg
        errors = {tick: excess[leg] + sign * (tick - time) for tick in sorted(around)}
        tick = min(errors, key=lambda t: (round(abs(errors[t]), 6), abs(t - time)))
        excess[leg] = errors[tick]
        ticks[v].append(tick)
        latest = max(latest, tick)
    return ticks


def _apart(edges: Sequence[float]) -> list[float]:
    """The edges of a valve, each at least a tick after the one before."""
    found: list[float] = []
    for time in edges:
        found.append(max(time, found[-1] + 1.0) if found else time)
    return found


PERIOD = 1e-3  # s


def controller_table(model: Model, plan: Trajectory, hold: float = 0.0) -> Trajectory:
    """What the controller plays, one row a tick; each row holds until the next.

    Its clock is the plan's. It starts `hold` [s] before the plan, or the longest dead time of a
    valve if that is longer; until then the first pose is held, valves closed. Hip angles and rates
    are the plan's at the tick, because the controller compares them with what it measures there.
    The torque is the mean of the plan over the tick, so that the angular impulse is the plan's.
    Valves are exactly 0 or 1, sent their dead time early, and their edges are rounded to ticks: see
    `kemba.ocp.controller`. The state in which a plan in motion begins is in the metadata, `start`.
    """
    dead = max(max(model.timing(leg)) for leg in model.mechanism.legs)
    lead = int(np.ceil(max(dead, hold) / PERIOD - 1e-9))
    duration = plan.time[-1] - plan.time[0]
    ticks = np.arange(lead + int(np.ceil(duration / PERIOD - 1e-9)) + 1)
    clock = plan.time[0] + (ticks - lead) * PERIOD
    columns: dict[str, np.ndarray] = {}
    states, valves = plan.interpolate(clock), _valves(model, plan, lead, len(ticks))
    for leg in model.mechanism.legs:
        q, w = course(plan, f"{leg}/hip/q", f"{leg}/hip/w", clock)
        columns |= {f"{leg}/hip/q [rad]": q, f"{leg}/hip/w [rad.s-1]": w}
        columns[f"{leg}/hip/tau [N.m]"] = _means(plan.time, plan[f"{leg}/hip/tau"], clock)
        for chamber in ("extend", "retract"):
            name = f"{leg}/valve/{chamber}"
            columns[f"{name} [1]"] = valves[name]
    for name in ("body/x", "body/z", "body/pitch"):
        columns[f"{name} [{plan.unit(name)}]"] = states[name]
    for leg in model.mechanism.legs:
        columns[f"{leg}/piston/x [m]"] = states[f"{leg}/piston/x"]
    meta = {"kind": "controller", "lead": lead / round(1 / PERIOD)}
    if start := moving_start(model, plan):
        meta["start"] = start
    rows = (ticks - lead) / round(1 / PERIOD)
    return Trajectory(rows, columns, meta | model.mechanism.scene.dump())


def _means(time: np.ndarray, values: np.ndarray, clock: np.ndarray) -> np.ndarray:
    """Means over the ticks (n,) of what is values[k] on (t[k-1], t[k]]: nothing before the first
    time, and the last value stays."""
    knots = np.append(time, time[-1] + 2 * PERIOD)
    held = np.append(values[1:], values[-1])
    integral = np.concatenate([[0.0], np.cumsum(held * np.diff(knots))])
    means: np.ndarray = np.diff(np.interp([*clock, clock[-1] + PERIOD], knots, integral)) / PERIOD
    return means


def _valves(model: Model, plan: Trajectory, lead: int, rows: int) -> dict[str, np.ndarray]:
    """The commands (rows,) of every valve such that they act as planned."""
    names, edges = [], []
    for i, leg in enumerate(model.mechanism.legs):
        on, off = model.timing(leg)
        for chamber, force in (("extend", 1.0), ("retract", -1.0)):
            name = f"{leg}/valve/{chamber}"
            value = np.round(plan[name][1:])  # an interrupted plan may not be binary yet
            k = np.flatnonzero(np.diff(value, prepend=0.0))
            early = plan.time[k] - plan.time[0] - np.where(value[k] > 0.5, on, off)
            names.append(name)
            edges.append(ValveEdges((lead + early / PERIOD).tolist(), i, force))
    found = {}
    for name, switched in zip(names, rounded(edges), strict=True):
        found[name] = np.zeros(rows)
        for i, tick in enumerate(switched):
            found[name][tick:] = float(i % 2 == 0)
    return found


def course(plan: Trajectory, angle: str, rate: str, clock: Array) -> tuple[Array, Array]:
    """Angles and rates (n,) of a joint at the times `clock` (n,) [s]; constant before and after."""
    t, q, w = plan.time, plan[angle], plan[rate]
    if "phases" not in plan.meta:
        return np.interp(clock, t, q), np.interp(clock, t, w)
    k = np.clip(np.searchsorted(t, clock, side="right") - 1, 0, len(t) - 2)
    h, rise = np.diff(t), np.diff(q)
    begin, end = begin_ways(plan.meta, q, h * w[:-1], h * w[1:]), h * w[1:]
    s = np.clip((clock - t[k]) / h[k], 0.0, 1.0)
    a, b = (begin - rise)[k], (rise - end)[k]
    rates = (rise[k] + (1 - 2 * s) * ((1 - s) * a + s * b) + s * (1 - s) * (b - a)) / h[k]
    inside = (clock >= t[0]) & (clock <= t[-1])
    angles = cubic(q[k], q[k + 1], begin[k], end[k], s)
    return angles, np.where(inside, rates, np.interp(clock, t, w))
