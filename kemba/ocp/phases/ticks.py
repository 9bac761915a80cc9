"""Valve edges of a multi-phase program on the ticks of the controller.

A table with many short pulses loses millimetres when its edges are rounded afterwards. With the
edges on ticks beforehand the plan is the best one that a table can hold.
"""

from collections.abc import Sequence

import casadi as ca
import numpy as np

from kemba.model import Model
from kemba.ocp.controller import PERIOD
from kemba.ocp.edges import ValveEdges, rounded
from kemba.ocp.phases.modes import Phase
from kemba.ocp.phases.program import PhaseProgram
from kemba.ocp.transcription.layout import STEP
from kemba.ocp.transcription.symmetry import Reduction


def edge_times(
    model: Model, reduction: Reduction, phases: Sequence[Phase], borders: np.ndarray
) -> dict[int, float]:
    """When [s] phases that begin with a valve edge should begin, so that all edges are on ticks.

    `borders` (phases,): when they begin now; the first one stays at 0. Where edges of one moment
    have dead times that are no whole ticks apart, the first valve decides.
    """
    valves, edges, owners = _valves(model, reduction), [], []
    longest = max(max(model.timing(leg)) for leg in model.mechanism.legs)
    lead = float(np.ceil(longest / PERIOD))  # commands come before what they do
    for j, (leg, force) in enumerate(valves):
        dead = model.timing(model.mechanism.legs[leg])
        before = 0.0
        own: list[tuple[int, float]] = []
        ticks: list[float] = []
        for p, phase in enumerate(phases):
            if phase.valves[j] != before:
                before = phase.valves[j]
                own.append((p, dead[0 if before else 1]))
                ticks.append(lead + (float(borders[p]) - own[-1][1]) / PERIOD)
        edges.append(ValveEdges(ticks, leg, force))
        owners.append(own)
    found: dict[int, float] = {}
    for own, chosen in zip(owners, rounded(edges), strict=True):
        for (p, late), tick in zip(own, chosen, strict=True):
            if p:
                found.setdefault(p, (tick - lead) * PERIOD + late)
    return dict(sorted(found.items()))


def _valves(model: Model, reduction: Reduction) -> list[tuple[int, float]]:
    """The leg that each valve of a phase drives, and which way it pushes."""
    keys = [key for key, q in model.inputs.items() if q.binary]
    places = [i for i, q in enumerate(model.inputs.values()) if q.binary]
    B, legs = reduction.B["u"][places], list(model.mechanism.legs)
    firsts = [int(np.flatnonzero(B[:, j])[0]) for j in range(B.shape[1]) if B[:, j].any()]
    return [(legs.index(str(keys[i][0])), 1.0 if keys[i][1] == "u_e" else -1.0) for i in firsts]


def on_ticks(program: PhaseProgram, x: np.ndarray) -> None:
    """Add the rows that keep the valve edges of a program on ticks, rounded from those of x
    (size,)."""
    h, phases = program.columns.h[:, 0], program.phases
    lasts = np.array([phase.elements * x[h[p]] * STEP for p, phase in enumerate(phases)])
    borders = np.concatenate([[0.0], np.cumsum(lasts)[:-1]])
    for p, time in edge_times(program.model, program.reduction, phases, borders).items():
        z = ca.SX.sym("h", p)
        begins = ca.dot(z, ca.DM([phase.elements for phase in phases[:p]]))
        program.add("valve edge", z, begins, time / STEP, time / STEP, [h[:p]])
