"""Names that a task gives to costs and IPOPT's options, checked before anything is built."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from kemba.config import Document
from kemba.errors import KembaError, suggest
from kemba.ocp.task.costs import COSTS

# what users of this package reasonably set; HSL and Pardiso options need libraries that are not
# in the wheel, and a failed load makes the next solve crash
KNOWN = {
    "tol": float,
    "dual_inf_tol": float,
    "constr_viol_tol": float,
    "compl_inf_tol": float,
    "acceptable_tol": float,
    "acceptable_iter": int,
    "max_iter": int,
    "max_cpu_time": float,
    "mu_strategy": str,
    "mu_init": float,
    "mu_oracle": str,
    "mu_linear_decrease_factor": float,
    "mu_superlinear_decrease_power": float,
    "bound_push": float,
    "bound_frac": float,
    "bound_relax_factor": float,
    "nlp_scaling_method": str,
    "hessian_approximation": str,
    "limited_memory_max_history": int,
    "max_soc": int,
    "watchdog_shortened_iter_trigger": int,
    "line_search_method": str,
    "linear_solver": str,
    "linear_scaling_on_demand": str,
    "min_refinement_steps": int,
    "max_refinement_steps": int,
    "mumps_pivtol": float,
    "mumps_pivtolmax": float,
    "mumps_mem_percent": int,
    "mumps_permuting_scaling": int,
    "mumps_pivot_order": int,
    "mumps_scaling": int,
    "print_level": int,
    "expect_infeasible_problem": str,
    "required_infeasibility_reduction": float,
    "start_with_resto": str,
}
LINEAR_SOLVERS = ("mumps", "spral")


def cost_errors(costs: Iterable[str], document: Document) -> list[KembaError]:
    """Every cost that there is not."""
    return [
        document.error(("cost", name), f"cost: unknown cost '{name}'", hint=suggest(name, COSTS))
        for name in costs
        if name not in COSTS
    ]


def option_errors(options: Mapping[str, Any], document: Document) -> list[KembaError]:
    """Every unknown option, wrong type or missing linear solver."""
    errors = []
    for name, value in options.items():
        at = ("solver", "options", name)
        if name not in KNOWN:
            hint = suggest(name, KNOWN)
            errors.append(document.error(at, f"solver.options: unknown option '{name}'", hint=hint))
        elif not isinstance(value, KNOWN[name] if KNOWN[name] is not float else (int, float)):
            kind = {int: "an integer", float: "a number", str: "a word"}[KNOWN[name]]
            what = f"solver.options.{name}: '{value}' is not {kind}"
            errors.append(document.error(at, what))
        elif name == "linear_solver" and value not in LINEAR_SOLVERS:
            what = f"solver.options.linear_solver: '{value}' is not in the installed IPOPT"
            errors.append(document.error(at, what, hint="one of: mumps, spral"))
    return errors
