"""Modes that do not fit: they are changed where an elastic program had to give way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kemba.ocp.phases.modes import AHEAD, BACK, HELD, OPEN, Phase
from kemba.ocp.phases.program import PhaseProgram
from kemba.ocp.phases.settings import Elements, Repair


def misfit(program: PhaseProgram, x: np.ndarray) -> np.ndarray:
    """How far every constraint's mode gives way in every phase (phases, constraints), by the
    worst of its scaled rows."""
    found = np.zeros((len(program.phases), len(program.constraints)))
    for soft in program.soft:
        for way in (soft.above, soft.below):
            if way is not None:
                np.maximum.at(found[:, soft.constraint], soft.phases, x[way])
    return found


def repaired(program: PhaseProgram, x: np.ndarray, marks: Sequence[int]) -> list[Phase] | None:
    """Phases with the modes changed where they fit worst; None where nothing is left to change.

    A phase that is short or has collapsed takes the modes of a neighbour; elsewhere the constraint
    that gives way most changes its mode.
    """
    repair = Repair.current()
    blame = misfit(program, x)
    phases = list(program.phases)
    worst = blame.max(axis=1)
    touched: set[int] = set()
    for p in np.argsort(-worst):
        if worst[p] <= max(repair.fits, repair.matters * worst.max()):
            break
        short = _shortest_near(program, x, int(p))
        if touched & {int(p), short}:
            continue
        if short is not None:
            modes = _nearest_modes(phases, short)
            touched |= {short - 1, short, short + 1}
        else:
            short, i = int(p), int(np.argmax(blame[p]))
            modes = _changed(program, x, short, i)
            touched |= {short}
        phases[short] = replace(phases[short], modes=modes)
    found = merged(phases, marks)
    return None if found == merged(program.phases, marks) else found


def simplified(program: PhaseProgram, x: np.ndarray, marks: Sequence[int]) -> list[Phase] | None:
    """Phases without those that collapsed between two others; None where none did."""
    h = x[program.columns.h[:, 0]] * program.layout.scale[program.layout.slices["h"]][0]
    least = _collapsed(program)
    phases = list(program.phases)
    for p in range(1, len(phases) - 1):
        around = (phases[p - 1].modes, phases[p + 1].modes)
        if h[p] * phases[p].elements <= least and phases[p].modes not in around:
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


def _collapsed(program: PhaseProgram) -> float:
    """Element duration [s] below which a phase has collapsed."""
    shortest = Elements.current().shortest * program.task.duration / program.nodes
    return Repair.current().collapsed * shortest


def _shortest_near(program: PhaseProgram, x: np.ndarray, p: int) -> int | None:
    """The shortest of phase p and its neighbours whose modes may be replaced, or None.

    Shortest by its elements, then by its duration in x, which the elastic program may distort.
    """
    h = x[program.columns.h[:, 0]] * program.layout.scale[program.layout.slices["h"]][0]
    least = _collapsed(program)
    last = len(program.phases) - 1
    near = [
        k
        for k in (p - 1, p, p + 1)
        if 0 < k < last
        and (program.phases[k].elements <= Repair.current().sliver or h[k] <= least)
        and _nearest_modes(program.phases, k) != program.phases[k].modes
    ]
    return min(near, key=lambda k: (program.phases[k].elements, h[k]), default=None)


def _nearest_modes(phases: Sequence[Phase], p: int) -> tuple[int, ...]:
    """The modes of the neighbour that differ least, the longer neighbour's if both do."""
    sides = [phases[p - 1], phases[p + 1]]

    def distance(other: Phase) -> tuple[int, int]:
        differ = sum(a != b for a, b in zip(other.modes, phases[p].modes, strict=True))
        return (differ or len(other.modes) + 1, -other.elements)

    return min(sides, key=distance).modes


def _changed(program: PhaseProgram, x: np.ndarray, p: int, i: int) -> tuple[int, ...]:
    """The modes of phase p; constraint i gets the mode that its worst violation suggests."""
    worst, kind, sign = 0.0, "", 0
    for soft in program.soft:
        here = soft.phases == p
        if soft.constraint != i or not here.any():
            continue
        for way, side in ((soft.above, 1), (soft.below, -1)):
            size = 0.0 if way is None else float(x[way[here]].max())
            if size > worst:
                worst, kind, sign = size, soft.kind, side
    modes = list(program.phases[p].modes)
    modes[i] = _other(modes[i], kind, sign)
    return tuple(modes)


def _other(mode: int, kind: str, sign: int) -> int:
    if kind in ("touch", "rate"):
        return OPEN
    if kind == "slip" and mode == HELD:
        return AHEAD if sign > 0 else BACK
    if kind == "cone forward" and mode == HELD:
        return BACK
    if kind == "cone backward" and mode == HELD:
        return AHEAD
    return HELD
