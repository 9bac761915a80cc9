"""Multipliers of a solution on the elements of another program with the same phases.

An element that is split in two shares its multipliers: those of its bounds and of the rows that
hold all along it stand for a stretch of time. Those of its collocation rows are the adjoints at a
moment, since these rows are times the step already.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence

import numpy as np

from kemba.ocp.nlp.ipopt import Iterate
from kemba.ocp.phases.columns import Columns
from kemba.ocp.phases.modes import Phase
from kemba.ocp.phases.program import PhaseProgram
from kemba.ocp.phases.radau import STATE
from kemba.ocp.phases.stages import Stages

COLLOCATION = ("kinematics:", "dynamics:", "rate:")


def with_multipliers(program: PhaseProgram, solved: Stages, x: np.ndarray) -> Iterate:
    """A start x (size,) of a program with the multipliers of a solution, where they are known.

    They are 0 for rows that the solved program did not have. Nothing may be added to the program
    afterwards.
    """
    kept = solved.scaled(program)
    if kept is None or len(solved.of_bounds) == 0 or len(x) != program.columns.size:
        return Iterate(x)
    of_bounds = _of_bounds(program, kept[0], solved.of_bounds)
    return Iterate(x, of_bounds, _of_rows(program, solved))


def _of_bounds(program: PhaseProgram, old: Columns, known: np.ndarray) -> np.ndarray:
    """Multipliers of the bounds (size,), from those at the columns `old`."""
    c, found = program.columns, np.zeros(program.columns.size)
    for g in STATE:
        found[c.first[g]] = known[old.first[g]]
    for p, (phase, before) in enumerate(zip(program.phases, old.phases, strict=True)):
        ratio = before.elements / phase.elements
        found[c.h[p]] = known[old.h[p]] / ratio
        for e in range(phase.first, phase.last):
            m = before.first + int((e + 0.5 - phase.first) * ratio)
            found[c.u[e]] = known[old.u[m]] * ratio
            for stage, its in zip(c.stages[e], old.stages[m], strict=True):
                for g in (*STATE, "lam"):
                    found[stage[g]] = known[its[g]] * ratio
    for p in program.impacts:
        found[c.after[p]], found[c.impulse[p]] = known[old.after[p]], known[old.impulse[p]]
    return found


def _of_rows(program: PhaseProgram, solved: Stages) -> np.ndarray:
    """Multipliers (rows,): of the row with the same label, in its order at the node before."""
    known: defaultdict[tuple[str, int], list[float]] = defaultdict(list)
    for label, table in solved.of_rows.items():
        for node, multiplier in table:
            known[label, int(node)].append(float(multiplier))
    own, old = _phase_at(program.phases), _phase_at(solved.phases)
    fine = Counter((row.label, own[row.node]) for row in program.rows)
    coarse: Counter[tuple[str, int]] = Counter()
    for (label, node), multipliers in known.items():
        coarse[label, old[node]] += len(multipliers)
    before = _nodes_before(program.phases, solved.phases)
    found, order = np.zeros(len(program.rows)), Counter[tuple[str, int]]()
    for i, row in enumerate(program.rows):
        at = row.label, row.node
        there, k = known.get((row.label, before[row.node]), []), order[at]
        order[at] += 1
        if k < len(there):
            kind = row.label, own[row.node]
            moment = row.label.startswith(COLLOCATION)
            found[i] = there[k] * (1.0 if moment else coarse[kind] / fine[kind])
    return found


def _phase_at(phases: Sequence[Phase]) -> list[int]:
    """The phase that ends at or after each node; -1 at the first."""
    return [-1, *(p for p, phase in enumerate(phases) for _ in range(phase.elements))]


def _nodes_before(phases: Sequence[Phase], old: Sequence[Phase]) -> list[int]:
    """At each node the end of the old element in which the middle of its element is."""
    found = [0]
    for phase, before in zip(phases, old, strict=True):
        middles = (np.arange(phase.elements) + 0.5) * before.elements / phase.elements
        found += [before.first + int(middle) + 1 for middle in middles]
    return found
