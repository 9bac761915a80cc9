"""The position of every variable of a multi-phase program."""

from collections.abc import Sequence

import numpy as np

from kemba.ocp.phases.modes import Phase
from kemba.ocp.phases.radau import STATE, width
from kemba.ocp.transcription.layout import Layout


class Columns:
    """Indices of everything in the vector x of a multi-phase program.

    `first`: state at the start, by group; `stages[e][i]`: state and forces at stage i of element e;
    `u` (elements, nu): inputs; `h` (phases, 1): element durations; `after`, `impulse`: velocities
    after and impulses at the impact that begins a phase.
    """

    def __init__(
        self, layout: Layout, phases: Sequence[Phase], impacts: Sequence[int], stages: int
    ) -> None:
        self.size = 0
        elements = phases[-1].last
        binary = [c - layout.slices["u"].start for c in layout.binary]
        n = {group: width(layout, group) for group in layout.slices}
        self.first = {g: self._new(n[g]) for g in STATE}
        stage_groups = (*STATE, "lam")
        self.stages = [
            [{g: self._new(n[g]) for g in stage_groups} for _ in range(stages)]
            for _ in range(elements)
        ]
        smooth = [i for i in range(n["u"]) if i not in binary]
        self.u = np.empty((elements, n["u"]), dtype=int)
        self.h = np.empty((len(phases), 1), dtype=int)
        for p, phase in enumerate(phases):
            self.u[phase.first : phase.last, binary] = self._new(len(binary))
            self.h[p] = self._new(1)
        for e in range(elements):
            self.u[e, smooth] = self._new(len(smooth))
        self.after = {p: self._new(n["v"]) for p in impacts}
        self.impulse = {p: self._new(n["lam"]) for p in impacts}
        self.phase_of = [p for p, phase in enumerate(phases) for _ in range(phase.elements)]
        self.starts = {phase.first: p for p, phase in enumerate(phases)}

        self.phases = list(phases)

    def _new(self, count: int) -> np.ndarray:
        self.size += count
        return np.arange(self.size - count, self.size)

    def nodes(self) -> np.ndarray:
        """The node that every column belongs to (size,); 0 for what phases share."""
        found = np.zeros(self.size, dtype=int)
        for e, stages in enumerate(self.stages):
            for stage in stages:
                for index in stage.values():
                    found[index] = e + 1
        for p, index in self.after.items():
            found[index] = found[self.impulse[p]] = self.phases[p].first
        return found

    def more(self, repeats: int, count: int) -> np.ndarray:
        """New columns (repeats, count) behind all others."""
        return self._new(repeats * count).reshape(repeats, count)

    def end(self, node: int) -> dict[str, np.ndarray]:
        """Columns by group, each (width,), of q, v, s at a node, before its impact."""
        return self.first if node == 0 else self.stages[node - 1][-1]

    def begin(self, e: int) -> dict[str, np.ndarray]:
        """Columns by group, each (width,), of q, v, s at the start of element `e`, after an
        impact."""
        before, p = self.end(e), self.starts.get(e, -1)
        return {**before, "v": self.after[p]} if p in self.after else before

    def element(self, e: int) -> np.ndarray:
        """Columns (n,) of the variables z of element `e`."""
        start = self.begin(e)
        parts = [start[g] for g in STATE]
        parts += [stage[g] for stage in self.stages[e] for g in (*STATE, "lam")]
        return np.concatenate([*parts, self.u[e], self.h[self.phase_of[e]]])
