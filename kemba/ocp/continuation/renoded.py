"""A plan on phases with another number of nodes."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kemba.ocp.phases.modes import Phase
from kemba.trajectory import Array, Trajectory


def renoded(
    plan: Trajectory,
    phases: Sequence[Phase],
    nodes: int,
    marks: Sequence[float],
    even: bool = True,
) -> tuple[Trajectory, list[Phase]] | None:
    """The plan on `nodes` intervals and its phases there, each with intervals by how long it lasts;
    without `even` in proportion to those it has, so that what the task asks at nodes stays at the
    same moments.

    `marks`: fractions of the nodes at which the task asks for something; phases end there, before
    and after. None where a phase would be left without an interval.
    """
    old = phases[-1].last
    edges = sorted({0.0, 1.0, *(mark for mark in marks if 0.0 < mark < 1.0)})
    fixed = {round(edge * old): round(edge * nodes) for edge in edges}
    counts: list[int] = []
    stops = sorted(fixed)
    for a, b in itertools.pairwise(stops):
        inside = [p for p in phases if a <= p.first and p.last <= b]
        if not inside or inside[0].first != a or inside[-1].last != b:
            return None
        t = plan.time
        weights = [float(t[p.last] - t[p.first] if even else p.elements) for p in inside]
        share = _shared(weights, fixed[b] - fixed[a])
        if share is None:
            return None
        counts += share
    borders = np.concatenate([[0], np.cumsum(counts)])
    found = [
        replace(p, first=int(borders[i]), last=int(borders[i + 1])) for i, p in enumerate(phases)
    ]
    return _resampled(plan, phases, counts), found


def _shared(weights: Sequence[float], total: int) -> list[int] | None:
    """`total` intervals shared in proportion to `weights`, at least one each."""
    if total < len(weights):
        return None
    wanted = np.array(weights) * total / sum(weights)
    counts = np.maximum(1, np.round(wanted)).astype(int)
    while counts.sum() != total:
        sign = 1 if counts.sum() < total else -1
        gain = np.where((counts > 1) | (sign > 0), sign * (wanted - counts), -np.inf)
        counts[int(np.argmax(gain))] += sign
    return [int(c) for c in counts]


def _resampled(plan: Trajectory, phases: Sequence[Phase], counts: Sequence[int]) -> Trajectory:
    """The plan at even steps in each phase. Rows of a phase are those after its first node: there
    velocities are from before an impact, inputs and forces those of the phase before."""
    clocks, columns = [plan.time[:1]], {h: [plan[n][:1]] for h, n in _columns(plan)}
    for phase, count in zip(phases, counts, strict=True):
        t, rows = plan.time, slice(phase.first + 1, phase.last + 1)
        clock = t[phase.first] + (t[phase.last] - t[phase.first]) * np.arange(1, count + 1) / count
        clock[-1] = t[phase.last]
        clocks.append(clock)
        for header, name in _columns(plan):
            columns[header].append(np.interp(clock, t[rows], plan[name][rows]))
    joined: dict[str, Array] = {header: np.concatenate(parts) for header, parts in columns.items()}
    return Trajectory(np.concatenate(clocks), joined, plan.meta)


def _columns(plan: Trajectory) -> list[tuple[str, str]]:
    return list(zip(plan.headers, plan.names, strict=True))
