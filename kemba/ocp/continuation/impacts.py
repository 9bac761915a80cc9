"""A start whose impacts are met: a trajectory has the velocities before an impact only."""

from __future__ import annotations

import casadi as ca
import numpy as np

from kemba.ocp.phases.program import PhaseProgram


def with_impacts(program: PhaseProgram, x: np.ndarray, ease: float) -> np.ndarray:
    """x (size,) with velocities after impacts and impulses that meet the rows of the impact.

    Velocities at the end of the first element after it are carried back to its begin, then changed
    as little as the rows need; those of the element's stages lie in between. `ease`: how much
    rather impulses change than velocities.
    """
    x, c = x.copy(), program.columns
    if not program.impacts:
        return x
    own = len(c.after[program.impacts[0]]) + len(c.impulse[program.impacts[0]])
    unknown = program.jump.z[-own:]
    rows = ca.Function(
        "rows", [program.jump.z], [program.jump.g, ca.jacobian(program.jump.g, unknown)]
    )
    for p in program.impacts:
        first = program.phases[p].first
        last = min(first + 1, program.nodes - 1)
        begin, ends = c.end(first), [c.stages[e][-1]["v"] for e in (first, last)]
        if program.phases[p].elements > 1:
            x[c.after[p]] = 2.0 * x[ends[0]] - x[ends[1]]
        at = np.concatenate([begin["q"], begin["v"], begin["s"], c.after[p], c.impulse[p]])
        columns = at[-own:]
        free = program.lower[columns] < program.upper[columns]
        g, slope = (np.array(part) for part in rows(x[at]))
        weights = np.where(np.isin(columns, c.impulse[p]), ease, 1.0)[free]
        x[columns[free]] -= weights * (np.linalg.pinv(slope[:, free] * weights) @ g.ravel())
        for stage, share in zip(c.stages[first], program.scheme.points, strict=True):
            x[stage["v"]] = x[c.after[p]] + share * (x[ends[0]] - x[c.after[p]])
    return np.asarray(np.clip(x, program.lower, program.upper))
