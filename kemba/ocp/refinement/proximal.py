"""Proximal points: a program whose solves wander is solved near one point after the other.

Minimising f(x) + w/2 |x - x_k|^2 gives x_(k+1); with an exact solution of each, the points go to a
minimum of f whatever w is (Rockafellar, SIAM J. Control Optim. 14, 1976). Where many phases meet,
rows are nearly dependent, and the solve for f alone leaves a feasible start and does not return.
The pull w falls from point to point, to none if it can; every point is feasible.
"""

from collections.abc import Callable

import numpy as np

from kemba.ocp.nlp.ipopt import Iterate
from kemba.ocp.phases.program import PhaseProgram

Solution = tuple[PhaseProgram, Iterate]

PULLS = (1.0, 0.1, 0.01, 1e-3, 0.0)  # on scaled variables, whose cost is about 1


def proximal_points(
    make: Callable[[PhaseProgram, np.ndarray], tuple[PhaseProgram, np.ndarray]],
    solve: Callable[[PhaseProgram, np.ndarray], Iterate],
    program: PhaseProgram,
    x: np.ndarray,
) -> Solution | None:
    """The last point that is solved, with its program; None where the first is not.

    `make`: the program from where an earlier one is (size,), and its start. Each solve is that of
    `solve`, from x (size,) of `program` on.
    """
    last: Solution | None = None
    for pull in PULLS:
        program, start = make(program, x)
        found = solve(program, program.proximal(start, pull) if pull else start)
        if not found.solved:
            break
        last, x = (program, found), found.Y
    return last
