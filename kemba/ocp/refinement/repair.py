"""Modes that do not fit: they are changed in the elements where an elastic program violates them.

The elastic program is an exact penalty: its slacks are zero but where modes contradict each other.
So the mode of a constraint changes in those elements only, the way the sign of the slack says.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from kemba.ocp.phases.modes import AHEAD, BACK, HELD, OPEN, Phase
from kemba.ocp.phases.program import PhaseProgram
from kemba.ocp.phases.settings import Elements, Refining

FAR = 0.1  # of the worst misfit
FITS = 10.0  # times the tolerance of rows: a larger slack is no rounding


class Misfit(NamedTuple):
    """The mode of a constraint that is violated in an element: what it asks, the side, how far."""

    element: int
    constraint: int
    kind: str
    side: int
    size: float


def misfits(program: PhaseProgram, x: np.ndarray) -> list[Misfit]:
    """What an elastic program violates at `x` (size,), scaled variables, in the order of time.

    With an exact penalty, slacks of modes that fit are zero to the solver's tolerance.
    """
    found, fits = [], FITS * Refining.current().rough_rows
    for soft in program.soft:
        for way, side in ((soft.above, 1), (soft.below, -1)):
            for e, size in zip(soft.elements, x[way], strict=True) if way is not None else ():
                if size > fits:
                    found.append(Misfit(int(e), soft.constraint, soft.kind, side, float(size)))
    return sorted(found)


def repaired(
    program: PhaseProgram, found: Sequence[Misfit], marks: Sequence[int]
) -> list[Phase] | None:
    """Phases with other modes where they do not fit; None where nothing is left to change.

    What is violated far less than the worst is left, for it may follow from that, and so is what
    comes later in the same touch. The times of borders are free, so a touch that is too early comes
    after the next event: it leaves the whole phase.
    """
    modes = np.array([p.modes for p in program.phases for _ in range(p.elements)])
    before, begun = modes.copy(), set()
    worst = max((misfit.size for misfit in found), default=0.0)
    for misfit in (m for m in found if m.size > FAR * worst):
        e, i = misfit.element, misfit.constraint
        own = before[:, i]
        if misfit.kind not in ("touch", "rate", "approach"):
            modes[e, i] = _other(own, misfit)
            continue
        first = e
        while first > 0 and own[first - 1] != OPEN:
            first -= 1
        if (i, first) in begun:
            continue
        begun.add((i, first))
        phase = program.phases[program.columns.phase_of[e]]
        last = phase.last if e == first else e + 1
        modes[e:last, i] = OPEN
    phases = [
        replace(p, first=e, last=e + 1, modes=tuple(int(m) for m in modes[e]))
        for p in program.phases
        for e in range(p.first, p.last)
    ]
    new = merged(phases, marks)
    return None if new == merged(program.phases, marks) else new


def _other(modes: np.ndarray, misfit: Misfit) -> int:
    """The mode that a violation suggests; `modes` (elements,): those of the constraint."""
    e, kind, side = misfit.element, misfit.kind, misfit.side
    mode = int(modes[e])
    if kind == "gap":  # closed still, or already, as beside it
        beside = [int(modes[k]) for k in (e - 1, e + 1) if 0 <= k < len(modes)]
        return max(beside) or HELD
    slides = {"slip": side, "settles": side, "cone forward": -1, "cone backward": 1}
    if kind == "settles" or (kind in slides and mode == HELD):
        return AHEAD if slides[kind] > 0 else BACK
    return HELD if kind in slides else mode


def simplified(program: PhaseProgram, x: np.ndarray, marks: Sequence[int]) -> list[Phase] | None:
    """Phases without those that collapsed between two others; None where none did.

    `x` (size,): scaled variables.
    """
    h = x[program.columns.h[:, 0]] * program.layout.scale[program.layout.slices["h"]][0]
    shortest = Elements.shortest * program.task.duration / program.nodes
    phases = list(program.phases)
    for p in range(1, len(phases) - 1):
        around = (phases[p - 1].modes, phases[p + 1].modes)
        brief = h[p] * phases[p].elements <= Elements.collapsed * shortest
        if brief and phases[p].modes not in around:
            phases[p] = replace(phases[p], modes=_nearest_modes(phases, p))
    found = merged(phases, marks)
    return None if found == merged(program.phases, marks) else found


def merged(phases: Sequence[Phase], marks: Sequence[int]) -> list[Phase]:
    """Neighbours with the same modes and valves as one phase, except across `marks`."""
    found = [phases[0]]
    for phase in phases[1:]:
        last = found[-1]
        same = (last.modes, last.valves) == (phase.modes, phase.valves)
        if same and phase.first not in marks:
            found[-1] = replace(last, last=phase.last)
        else:
            found.append(phase)
    return found


def _nearest_modes(phases: Sequence[Phase], p: int) -> tuple[int, ...]:
    """The modes of the neighbour that differ least, the longer neighbour's if both do."""
    sides = [phases[p - 1], phases[p + 1]]

    def distance(other: Phase) -> tuple[int, int]:
        differ = sum(a != b for a, b in zip(other.modes, phases[p].modes, strict=True))
        return (differ or len(other.modes) + 1, -other.elements)

    return min(sides, key=distance).modes
