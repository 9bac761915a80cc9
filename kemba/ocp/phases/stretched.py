"""Air on stretched legs: extending valves that open for a moment in the rise of the flight.

Behind vented chambers a leg comes down as long as friction, damping and the last impact have left
it, and so touches the ground at no certain time. A short pulse presses the pistons to their stops.
While they rest there it changes nothing else.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kemba.model import Model
from kemba.ocp.phases.modes import Phase
from kemba.ocp.transcription.symmetry import Reduction
from kemba.ocp.transcription.unilateral import Constraint
from kemba.trajectory import Array, Trajectory

EXTENDED = "end_stop:extended"
PARTS = 3  # of a phase: before the pulse, the pulse, after it


def extending(model: Model, reduction: Reduction) -> list[bool]:
    """Of each valve of a phase, whether it extends its leg."""
    symbols = [symbol for (_, symbol), q in model.inputs.items() if q.binary]
    places = [i for i, q in enumerate(model.inputs.values()) if q.binary]
    B = reduction.B["u"]
    valves = [j for j in range(B.shape[1]) if B[places, j].any()]
    return [symbols[int(np.flatnonzero(B[places, j])[0])] == "u_e" for j in valves]


def rising(phases: Sequence[Phase], constraints: Sequence[Constraint], apex: int) -> list[int]:
    """Which phases lie in the air before the node `apex`: every foot is off the ground."""
    feet = [i for i, c in enumerate(constraints) if c.friction is not None]
    return [
        p
        for p, phase in enumerate(phases)
        if phase.last <= apex and not any(phase.active(i) for i in feet)
    ]


def stretching(phase: Phase, extends: Sequence[bool]) -> bool:
    """Whether the extending valves of all legs are open and the others closed."""
    return all(bool(valve) == own for valve, own in zip(phase.valves, extends, strict=True))


def stretched(
    plan: Trajectory,
    phases: Sequence[Phase],
    constraints: Sequence[Constraint],
    extends: Sequence[bool],
    apex: int,
    air: float,
) -> tuple[Trajectory, list[Phase]]:
    """The plan with a pulse of `air` [s] in its rise, which may not fit yet; the same where it has
    one or does not fly.

    The pulse begins after a third of the first phase in which all legs rest on their extended stops
    (without such a phase: of the longest one in the air); the last third of it is left.
    """
    flight = rising(phases, constraints, apex)
    if any(stretching(phases[p], extends) for p in flight):
        return plan, list(phases)
    stops = [i for i, c in enumerate(constraints) if c.label.endswith(EXTENDED)]
    wide = [p for p in flight if phases[p].elements >= PARTS]
    resting = [p for p in wide if all(phases[p].active(i) for i in stops)]
    longest = max(wide, key=lambda p: _lasts(plan, phases[p]), default=None)
    host = min(resting, default=longest)
    if host is None:
        return plan, list(phases)
    plan, (before, pulse, after) = _in_three(plan, phases[host], air)
    pulse = replace(pulse, valves=tuple(float(own) for own in extends))
    return plan, [*phases[:host], before, pulse, after, *phases[host + 1 :]]


def _lasts(plan: Trajectory, phase: Phase) -> float:
    return float(plan.time[phase.last] - plan.time[phase.first])


def _in_three(plan: Trajectory, phase: Phase, air: float) -> tuple[Trajectory, list[Phase]]:
    """The plan with even steps in each of three parts of a phase, the middle one of `air` [s] or a
    third of it; it keeps its nodes."""
    begin, third = float(plan.time[phase.first]), _lasts(plan, phase) / PARTS
    lasts = min(air, third)
    edges = np.cumsum([begin, third, lasts, PARTS * third - third - lasts])
    middle = min(phase.elements - 2, max(1, round(phase.elements * lasts / (PARTS * third))))
    first = max(1, min(phase.elements - middle - 1, round(phase.elements / PARTS)))
    nodes = np.cumsum([phase.first, first, middle, phase.elements - first - middle])
    rows = slice(phase.first + 1, phase.last + 1)  # after an impact at the first node
    clock = np.interp(np.arange(phase.first + 1, phase.last + 1), nodes, edges)
    columns: dict[str, Array] = {}
    for header, name in zip(plan.headers, plan.names, strict=True):
        columns[header] = plan[name].copy()
        columns[header][rows] = np.interp(clock, plan.time[rows], plan[name][rows])
    time = plan.time.copy()
    time[rows] = clock
    parts = [replace(phase, first=int(a), last=int(b)) for a, b in itertools.pairwise(nodes)]
    return Trajectory(time, columns, plan.meta), parts
