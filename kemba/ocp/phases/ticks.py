"""Valves that switch on the ticks of the controller, so that its table loses nothing of the plan."""

from __future__ import annotations

from math import floor

import casadi as ca
import numpy as np

from kemba.ocp.controller import PERIOD
from kemba.ocp.phases.program import PhaseProgram

SNAP = 1e-6  # ticks; times this near are the same, far above rounding errors


def add_ticks(program: PhaseProgram, x: np.ndarray) -> bool:
    """Add rows that fix every valve edge to the tick it is near in `x` (size,), scaled variables.

    An edge is sent on a tick and acts the valve's dead time later. Returns whether there are any.
    """
    h = ca.SX.sym("h", len(program.phases))
    step = program.layout.scale[program.layout.slices["h"]][0]
    lasts = [phase.elements * step for phase in program.phases]
    begins = np.concatenate([[0.0], np.cumsum(lasts * x[program.columns.h[:, 0]])])
    edges = _edges(program)
    targets = on_ticks([(begins[p], dead) for p, dead in edges])
    for (p, _), target in zip(edges, targets, strict=True):
        begin = sum((lasts[k] * h[k] for k in range(p)), ca.SX(0))
        off = (begin - target) / program.task.duration
        program.add("tick", h, off, 0.0, 0.0, [program.columns.h[:, 0]])
    return bool(edges)


def on_ticks(edges: list[tuple[float, float]]) -> list[float]:
    """When edges act that are near a time [s] and are sent a dead time [s] before, on a tick.

    `edges` in order of time. The distance to the edge before does not fall below its whole ticks,
    so that pulses keep the least length they may have.
    """
    found: list[float] = []
    before = sent = None
    for time, dead in edges:
        wanted = (time - dead) / PERIOD
        tick = round(wanted)
        if before is not None and sent is not None:
            tick = max(tick, sent + max(1, floor(wanted - before + SNAP)))
        before, sent = wanted, tick
        found.append(tick * PERIOD + dead)
    return found


def _edges(program: PhaseProgram) -> list[tuple[int, float]]:
    """The phases with whose begin a valve switches, and its dead time [s]."""
    places = [i for i, q in enumerate(program.model.inputs.values()) if q.binary]
    names = [key for key, q in program.model.inputs.items() if q.binary]
    B = program.reduction.B["u"]
    legs = [
        names[int(np.flatnonzero(B[places, j])[0])][0]
        for j in range(B.shape[1])
        if B[places, j].any()
    ]
    found = []
    for p in range(1, len(program.phases)):
        before, after = program.phases[p - 1].valves, program.phases[p].valves
        switched = [j for j in range(len(after)) if before[j] != after[j]]
        if switched:
            on, off = program.model.timing(legs[switched[0]])
            found.append((p, on if after[switched[0]] > 0.5 else off))
    return found
