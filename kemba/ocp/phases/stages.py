"""A solved multi-phase program in physical units: what a trajectory leaves out are its stages.

Rebuilt from nodes, a start violates rows by several times their scale, and a plan with a phase of a
single element can then not even be solved again for the same figures.
"""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kemba.ocp.nlp.ipopt import Iterate
from kemba.ocp.phases.modes import Phase
from kemba.ocp.phases.program import Columns, PhaseProgram
from kemba.ocp.transcription.layout import STEP, Layout


@dataclass(frozen=True)
class Stages:
    """Values of all variables of a program with these phases, schemes with `stages` stages.

    `values` (size,): in SI units, impulses in N.s, steps in s. Multipliers of the scaled program,
    in units of its cost: `of_bounds` (size,), and `of_rows`, by the label of rows (n, 2) the node
    and the multiplier of each; empty where they are not known.
    """

    phases: tuple[Phase, ...]
    stages: int
    values: np.ndarray
    of_bounds: np.ndarray
    of_rows: Mapping[str, np.ndarray]

    @classmethod
    def of(cls, program: PhaseProgram, found: Iterate) -> Stages:
        """The solution of a program, scaled there."""
        scale = _scales(program.columns, program.layout)
        values, of_bounds = found.Y[: len(scale)] * scale, np.zeros(0)
        of_rows: dict[str, np.ndarray] = {}
        if found.lam_x is not None and found.lam_g is not None:
            of_bounds = found.lam_x[: len(scale)]
            for label, (rows, nodes) in _by_label(program).items():
                of_rows[label] = np.column_stack([nodes, found.lam_g[rows]])
        return cls(tuple(program.phases), program.scheme.stages, values, of_bounds, of_rows)

    @property
    def nodes(self) -> int:
        """Number of intervals."""
        return self.phases[-1].last

    def start(self, program: PhaseProgram) -> np.ndarray | None:
        """Scaled variables (size,) of another program; None where its phases are others."""
        kept = self.scaled(program) if tuple(program.phases) == self.phases else None
        if kept is None:
            return None
        x = kept[1]
        found: np.ndarray = np.clip(x, program.lower[: len(x)], program.upper[: len(x)])
        return found

    def scaled(self, program: PhaseProgram) -> tuple[Columns, np.ndarray] | None:
        """Columns and scaled variables (size,) on the own elements, for a program of the same
        phases on others; None where its phases are others."""
        same = [(p.modes, p.valves) for p in self.phases]
        if same != [(p.modes, p.valves) for p in program.phases]:
            return None
        columns = Columns(program.layout, self.phases, program.impacts, self.stages)
        scale = _scales(columns, program.layout)
        if program.scheme.stages != self.stages or len(scale) > len(self.values):
            return None
        return columns, self.values[: len(scale)] / scale

    def iterate(self, program: PhaseProgram, x: np.ndarray) -> Iterate:
        """A start x (size,) of another program, with the multipliers where they are known: 0 for
        rows that this one did not have. Nothing may be added to the program afterwards."""
        if len(x) != len(self.of_bounds):
            return Iterate(x)
        lam_g = np.zeros(len(program.rows))
        for label, (rows, nodes) in _by_label(program).items():
            if label in self.of_rows:
                lam_g[rows] = _at_nodes(self.of_rows[label], nodes)
        return Iterate(x, self.of_bounds, lam_g)


def _by_label(program: PhaseProgram) -> dict[str, tuple[list[int], list[int]]]:
    """The rows of each label, and their nodes."""
    found: dict[str, tuple[list[int], list[int]]] = {}
    for i, row in enumerate(program.rows):
        rows, nodes = found.setdefault(row.label, ([], []))
        rows.append(i)
        nodes.append(row.node)
    return found


def _at_nodes(table: np.ndarray, nodes: list[int]) -> np.ndarray:
    """Multipliers of a table (n, 2) at nodes (m,), one after the other where several rows are at
    one; 0 where there is none."""
    if np.array_equal(table[:, 0], nodes):
        return np.asarray(table[:, 1])
    known: defaultdict[int, deque[float]] = defaultdict(deque)
    for node, multiplier in table:
        known[int(node)].append(multiplier)
    return np.array([known[node].popleft() if known[node] else 0.0 for node in nodes])


def _scales(c: Columns, layout: Layout) -> np.ndarray:
    """What one of each variable is (size,); without variables that were added for a solve."""
    scale, known = np.ones(c.size), np.zeros(c.size, dtype=bool)

    def put(index: np.ndarray, group: str, times: float = 1.0) -> None:
        scale[index] = layout.scale[layout.slices[group]] * times
        known[index] = True

    for state in (c.first, *(stage for stages in c.stages for stage in stages)):
        for group in state:
            put(state[group], group)
    for inputs in c.u:
        put(inputs, "u")
    for p in c.after:
        put(c.after[p], "v")
        put(c.impulse[p], "lam", STEP)
    scale[c.h], known[c.h] = STEP, True
    return scale[: int(np.flatnonzero(known)[-1]) + 1]
