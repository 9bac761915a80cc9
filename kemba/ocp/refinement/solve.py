"""IPOPT on a multi-phase program: stopped when asked, given up when it gets nowhere."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from kemba.ocp.nlp.ipopt import COMMON, Watch, Watcher
from kemba.ocp.nlp.stagnation import GAVE_UP, Stagnation
from kemba.ocp.refinement.program import Program

STOPPED = "User_Requested_Stop"
EXACT: dict[str, Any] = {
    "tol": 1e-4,
    "constr_viol_tol": 1e-8,
    "acceptable_iter": 0,
    "mumps_pivtol": 1e-3,  # IPOPT's 1e-6 counts wrong signs on three stages, and steps shrink
    "max_hessian_perturbation": 1e6,  # beyond, tries cost a second an iteration and lead nowhere
}
PATIENCE = 30  # iterations in which the violation must fall
SMALL = 1e-4  # scaled violation below which nobody gives up


@dataclass(frozen=True)
class Control:
    """What ends a solve early and who hears of it: `deadline` in time.monotonic(), `stop` asked
    and `watch` told every iteration, IPOPT's text in `log`."""

    deadline: float = np.inf
    log: Path | None = None
    watch: Watch | None = None
    stop: Callable[[], bool] | None = None


@dataclass(frozen=True)
class PhaseSolution:
    """Where a solve ended: variables, IPOPT's word, iterations."""

    x: np.ndarray
    message: str
    iterations: int


def solve(
    program: Program, start: np.ndarray, options: dict[str, Any], control: Control
) -> PhaseSolution:
    """The program solved from `start`; it ends as IPOPT says, with `STOPPED` when asked to, or
    with `GAVE_UP`."""
    remaining = control.deadline - time.monotonic()
    if control.stop is not None and control.stop():
        return PhaseSolution(start, STOPPED, 0)
    if remaining <= 0:
        return PhaseSolution(start, "Maximum_WallTime_Exceeded", 0)
    own = {**COMMON, **program.task.solver.options, **EXACT, **options}
    if np.isfinite(remaining):
        own["max_wall_time"] = remaining
    if control.log is not None:
        own |= {"output_file": str(control.log), "file_print_level": 5, "file_append": "yes"}
    problem = program.problem
    elastic = program.elastic > 0.0  # such a program has a solution
    patience = Stagnation(np.inf if elastic else PATIENCE, SMALL)
    plugin = {
        "print_time": False,
        "error_on_fail": False,
        "grad_f": problem.grad_f,
        "jac_g": problem.jac_g,
        "hess_lag": problem.hess_lag,
        "calc_lam_p": False,
        "iteration_callback": Watcher(program, control.watch, control.stop, patience),
        **{f"ipopt.{name}": value for name, value in own.items()},
    }
    solver = ca.nlpsol("phases", "ipopt", problem.nlp, plugin)
    found = solver(
        x0=start,
        p=[],
        lbx=program.lower,
        ubx=program.upper,
        lbg=program.g_lower,
        ubg=program.g_upper,
    )
    stats = solver.stats()
    message = GAVE_UP if patience.lost else str(stats["return_status"])
    return PhaseSolution(np.array(found["x"]).ravel(), message, int(stats["iter_count"]))
