"""A solved multi-phase program in physical units: what a trajectory leaves out are its stages.

Rebuilt from nodes, a start violates rows by several times their scale, and a plan with a phase of a
single element can then not even be solved again for the same figures.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kemba.ocp.phases.modes import Phase
from kemba.ocp.phases.program import PhaseProgram
from kemba.ocp.transcription.layout import STEP


@dataclass(frozen=True)
class Stages:
    """Values of all variables of a program with these phases, schemes with `stages` stages.

    `values` (size,): in SI units, impulses in N.s, steps in s.
    """

    phases: tuple[Phase, ...]
    stages: int
    values: np.ndarray

    @classmethod
    def of(cls, program: PhaseProgram, x: np.ndarray) -> Stages:
        """The solution x (size,) of a program, scaled there."""
        scale = _scales(program)
        return cls(tuple(program.phases), program.scheme.stages, x[: len(scale)] * scale)

    @property
    def nodes(self) -> int:
        """Number of intervals."""
        return self.phases[-1].last

    def start(self, program: PhaseProgram) -> np.ndarray | None:
        """Scaled variables (size,) of another program; None where its phases are others."""
        scale = _scales(program)
        same = tuple(program.phases) == self.phases and program.scheme.stages == self.stages
        if not same or len(scale) > len(self.values):
            return None
        lower, upper = program.lower[: len(scale)], program.upper[: len(scale)]
        found: np.ndarray = np.clip(self.values[: len(scale)] / scale, lower, upper)
        return found


def _scales(program: PhaseProgram) -> np.ndarray:
    """What one of each variable is (size,); without variables that were added for a solve."""
    c, layout = program.columns, program.layout
    scale, own = np.ones(c.size), 0

    def put(index: np.ndarray, group: str, times: float = 1.0) -> None:
        nonlocal own
        scale[index] = layout.scale[layout.slices[group]] * times
        own = max(own, int(index.max(initial=-1)) + 1)

    for state in (c.first, *(stage for stages in c.stages for stage in stages)):
        for group in state:
            put(state[group], group)
    for inputs in c.u:
        put(inputs, "u")
    for p in c.after:
        put(c.after[p], "v")
        put(c.impulse[p], "lam", STEP)
    scale[c.h] = STEP
    return scale[: max(own, int(c.h.max()) + 1)]
