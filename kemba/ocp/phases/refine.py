"""Refining an implicit Euler plan: the same modes, solved again so that it replays."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from kemba.model import Model
from kemba.ocp.certify import Certificate
from kemba.ocp.ipopt import COMMON, SOLVED
from kemba.ocp.mirror import Reduction, find_symmetry, whole, wishes_are_symmetric
from kemba.ocp.phases.constraints import read_constraints
from kemba.ocp.phases.independent import Independent
from kemba.ocp.phases.modes import Phase, read_phases
from kemba.ocp.phases.program import Program
from kemba.ocp.phases.radau import RADAU3, RADAU5, STATE, Scheme
from kemba.ocp.phases.rules import add_rules
from kemba.ocp.phases.sample import certificate, to_trajectory
from kemba.ocp.phases.start import carried, start_vector
from kemba.ocp.phases.wishes import add_wishes
from kemba.ocp.result import arrays
from kemba.ocp.task import Task
from kemba.ocp.wishes import Wish
from kemba.trajectory import Trajectory

MIRRORED = 1e-6  # scaled; a plan that differs less from its mirror image is solved by half
# one scheme after the other: the coarser one finds the way, the finer one makes it exact
STEPS: tuple[tuple[Scheme, dict[str, Any]], ...] = (
    (RADAU3, {"mu_init": 1e-2, "bound_push": 1e-4, "bound_frac": 1e-4, "max_iter": 100}),
    (RADAU5, {"mu_init": 1e-3, "bound_push": 1e-6, "bound_frac": 1e-6, "max_iter": 100}),
)
EXACT = {"tol": 1e-4, "constr_viol_tol": 1e-8, "acceptable_iter": 0}


@dataclass(frozen=True)
class Refined:
    """A plan on phases: its trajectory, what it violates, how IPOPT ended and how long it took.

    `trajectory` and `certificate` are None where no program could be built or solved.
    """

    trajectory: Trajectory | None
    certificate: Certificate | None
    message: str
    iterations: int
    phases: tuple[Phase, ...] = ()

    @property
    def solved(self) -> bool:
        """Whether the finest scheme converged."""
        return self.trajectory is not None


def refine(
    model: Model,
    task: Task,
    wishes: Sequence[Wish],
    plan: Trajectory,
    reduction: Reduction | None = None,
    deadline: float = np.inf,
    log: Path | None = None,
) -> Refined:
    """The plan with its modes kept, phase durations free, and events where they happen.

    `reduction`: half or whole robot; by default the half where plan and task allow it. `deadline`
    is in time.monotonic(). `log` collects IPOPT's text.
    """
    reduction = reduction or reduction_of(model, task, wishes, plan)
    iterations = 0
    for trim in (False, True):
        try:
            found = _steps(model, task, wishes, plan, reduction, trim, deadline, log)
        except ValueError as error:
            return Refined(None, None, f"the model {error}", 0)
        iterations += found.iterations
        if found.solved:
            break
    return replace(found, iterations=iterations)


def _steps(
    model: Model,
    task: Task,
    wishes: Sequence[Wish],
    plan: Trajectory,
    reduction: Reduction,
    trim: bool,
    deadline: float,
    log: Path | None,
) -> Refined:
    """One reading of the modes, one scheme after the other."""
    iterations, message, x = 0, "", None
    program: Program | None = None
    for scheme, options in STEPS:
        finer, start = build(model, task, wishes, plan, reduction, scheme, trim)
        if program is not None and x is not None:
            start = carried(finer, program, x)
        program = finer
        x, message, count = _solve(program, start, options, deadline, log)
        iterations += count
        if message not in SOLVED:
            return Refined(None, None, message, iterations, tuple(program.phases))
    assert program is not None and x is not None
    trajectory = to_trajectory(program, x)
    found = certificate(program, x, trajectory)
    return Refined(trajectory, found, message, iterations, tuple(program.phases))


def reduction_of(model: Model, task: Task, wishes: Sequence[Wish], plan: Trajectory) -> Reduction:
    """Half the robot where model, task and plan are their own mirror images, else the whole."""
    half = find_symmetry(model) if task.solver.symmetry else None
    if half is None or not wishes_are_symmetric(model, wishes):
        return whole(model.node)
    x = arrays(model, plan)
    for name, matrix in half.B.items():
        mean = half.expand(name, half.restrict(name, x[name]))
        if matrix.size and np.abs(mean - x[name]).max() > MIRRORED * max(1.0, np.abs(mean).max()):
            return whole(model.node)
    return half


def build(
    model: Model,
    task: Task,
    wishes: Sequence[Wish],
    plan: Trajectory,
    reduction: Reduction,
    scheme: Scheme,
    trim: bool = False,
) -> tuple[Program, np.ndarray]:
    """The program of a plan's phases and its start. Raises ValueError for other models."""
    constraints = read_constraints(model, reduction)
    inputs = reduction.restrict("u", arrays(model, plan)["u"])
    valves = np.round(inputs[:, _binary(model, reduction)])
    last = len(plan) - 1
    marks = [wish.node(last) for wish in wishes if wish.at is not None]
    phases = read_phases(model, constraints, plan, valves, marks, trim)
    program = Program(model, task, reduction, phases, constraints, scheme)
    x = start_vector(program, plan)
    first, end = program.columns.first, program.columns.end(last)
    at_first = Independent({g: x[first[g]] for g in STATE})
    add_wishes(program, wishes, at_first, Independent({g: x[end[g]] for g in STATE}))
    add_rules(program, at_first)
    return program, np.clip(x, program.lower, program.upper)


def _binary(model: Model, reduction: Reduction) -> list[int]:
    places = [i for i, q in enumerate(model.inputs.values()) if q.binary]
    B = reduction.B["u"]
    return [j for j in range(B.shape[1]) if B[places, j].any()]


def _solve(
    program: Program,
    start: np.ndarray,
    options: dict[str, Any],
    deadline: float,
    log: Path | None,
) -> tuple[np.ndarray, str, int]:
    remaining = deadline - time.monotonic()
    if remaining <= 0:
        return start, "Maximum_WallTime_Exceeded", 0
    own = {**COMMON, **program.task.solver.options, **EXACT, **options}
    if np.isfinite(remaining):
        own["max_wall_time"] = remaining
    if log is not None:
        own |= {"output_file": str(log), "file_print_level": 5, "file_append": "yes"}
    problem = program.problem
    plugin = {
        "print_time": False,
        "error_on_fail": False,
        "grad_f": problem.grad_f,
        "jac_g": problem.jac_g,
        "hess_lag": problem.hess_lag,
        "calc_lam_p": False,
        **{f"ipopt.{name}": value for name, value in own.items()},
    }
    solver = ca.nlpsol("refine", "ipopt", problem.nlp, plugin)
    found = solver(
        x0=start,
        p=[],
        lbx=program.lower,
        ubx=program.upper,
        lbg=program.g_lower,
        ubg=program.g_upper,
    )
    stats = solver.stats()
    x = np.array(found["x"]).ravel()
    return x, str(stats["return_status"]), int(stats["iter_count"])
