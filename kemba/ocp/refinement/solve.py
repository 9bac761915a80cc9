"""A multi-phase program solved by IPOPT."""

from typing import Any

import numpy as np

from kemba.ocp.nlp.ending import Stagnation
from kemba.ocp.nlp.ipopt import Control, Ipopt, Iterate
from kemba.ocp.phases.program import PhaseProgram
from kemba.ocp.phases.settings import Refining


def solve(
    program: PhaseProgram,
    start: Iterate,
    options: dict[str, Any],
    control: Control,
    stagnation: Stagnation | None = None,
) -> Iterate:
    """The program solved from `start`; given up where the violation stagnates, by default as the
    settings say."""
    settings = Refining.current()
    own = {**program.task.solver.options, **exact(), **options}
    longest = settings.stagnation_iterations, settings.stagnation_near, settings.slow
    if program.elastic > 0.0:  # such a program has a solution
        stagnation = Stagnation(np.inf, 0.0)
    stagnation = stagnation or Stagnation(*longest)
    return Ipopt(program, own, control).solve(start, stagnation=stagnation)


def exact() -> dict[str, Any]:
    """IPOPT options of the finer scheme."""
    settings = Refining.current()
    return {
        "tol": settings.tol,
        "constr_viol_tol": settings.rows,
        "acceptable_iter": 0,
        "mumps_pivtol": settings.pivot,
        "mumps_permuting_scaling": settings.permuting,
        "max_hessian_perturbation": settings.hessian,
    }


def warm(iterations: int) -> dict[str, Any]:
    """IPOPT options of a warm start on primal values, with at most `iterations`."""
    settings = Refining.current()
    push = {"bound_push": settings.push, "bound_frac": settings.push}
    return {"mu_init": settings.mu, **push, "max_iter": iterations}


def rough(iterations: int) -> dict[str, Any]:
    """The same for the coarser scheme, whose solution is only a start."""
    settings = Refining.current()
    return {**warm(iterations), "tol": settings.rough_tol, "constr_viol_tol": settings.rough_rows}
