"""What is asked of a nonlinear program and of its functions; and terms added to them.

A proximal term is a small cost on the distance from the start. Where the cost is flat, as for
forces that legs share, Newton steps become long without any gain and lose feasibility. The proximal
term gives these directions curvature and hardly moves the optimum.
"""

from collections.abc import Sequence
from functools import cached_property
from typing import Any, Protocol

import casadi as ca
import numpy as np


class Derivatives(Protocol):
    """f and g of a program, and their derivatives, under the names that CasADi's nlpsol knows."""

    @property
    def nlp(self) -> dict[str, Any]: ...
    @property
    def grad_f(self) -> ca.Function: ...
    @property
    def jac_g(self) -> ca.Function: ...
    @property
    def hess_lag(self) -> ca.Function: ...


# of each derivative: what nlpsol gives it and takes from it
SIGNATURES = {
    "grad_f": (["x", "p"], ["f", "grad_f_x"]),
    "jac_g": (["x", "p"], ["g", "jac_g_x"]),
    "hess_lag": (["x", "p", "lam_f", "lam_g"], ["triu_hess_gamma_x_x"]),
}


def derivative(name: str, at: Sequence[Any], results: Sequence[Any]) -> ca.Function:
    """`grad_f`, `jac_g` or `hess_lag` of the symbols `at`, as nlpsol takes it."""
    return ca.Function(name, list(at), list(results), *SIGNATURES[name])


class NlpFunctions(Derivatives, Protocol):
    """The same, with its symbols x and p and how many variables and rows there are."""

    @property
    def x(self) -> Any: ...
    @property
    def parameter(self) -> Any: ...
    @property
    def size(self) -> int: ...
    @property
    def rows(self) -> int: ...


class Program(Protocol):
    """A nonlinear program: its functions, and the bounds of its variables and rows.

    `lower` and `upper` may have any shape with as many entries as the problem has variables;
    iterates have the same shape. `g_lower` and `g_upper` are (rows,).
    """

    @property
    def problem(self) -> NlpFunctions: ...
    @property
    def lower(self) -> np.ndarray:
        """Lower bounds of the variables, a vector or a matrix."""

    @property
    def upper(self) -> np.ndarray:
        """Upper bounds of the variables, a vector or a matrix."""

    @property
    def g_lower(self) -> np.ndarray:
        """Lower bounds (rows,) of the rows."""

    @property
    def g_upper(self) -> np.ndarray:
        """Upper bounds (rows,) of the rows."""


def violation(program: Program, g: np.ndarray) -> float:
    """The largest violation of the rows at values g (rows,), scaled as the rows are."""
    over = np.maximum(program.g_lower - g, g - program.g_upper)
    return float(over.max(initial=0.0))


# multiple of the identity in the Hessian of whole robots, per scaled variable, by
# benchmarks/variants.py; IPOPT's own additions are 1e-4 to 1
REGULARISATION = 2e-3


class Proximal:
    """A problem with weight / 2 |x - start|^2 added to its cost; its parameters become
    [p, weight, start]. Ready for `ca.nlpsol` like the problem itself."""

    def __init__(self, problem: NlpFunctions) -> None:
        self.problem = problem
        weight, start = ca.MX.sym("weight"), ca.MX.sym("start", problem.size)
        self.x, self.weight = problem.x, weight
        self.parameters = ca.vertcat(problem.parameter, weight, start)
        self.away = self.x - start

    @property
    def nlp(self) -> dict[str, ca.MX]:
        """x, p, f and g as expressions."""
        nlp = self.problem.nlp
        return {**nlp, "p": self.parameters, "f": nlp["f"] + self._cost}

    @cached_property
    def grad_f(self) -> ca.Function:
        """(x, p) -> f and its gradient."""
        f, gradient = self.problem.grad_f(self.x, self.problem.parameter)
        results = [f + self._cost, gradient + self.weight * self.away]
        return derivative("grad_f", [self.x, self.parameters], results)

    @cached_property
    def jac_g(self) -> ca.Function:
        """(x, p) -> g and its Jacobian."""
        results = self.problem.jac_g(self.x, self.problem.parameter)
        return derivative("jac_g", [self.x, self.parameters], results)

    @cached_property
    def hess_lag(self) -> ca.Function:
        """(x, p, lam_f, lam_g) -> upper triangle of the Lagrangian's Hessian."""
        lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", self.problem.rows)
        plain = self.problem.hess_lag(self.x, self.problem.parameter, lam_f, lam_g)
        hessian = plain + lam_f * self.weight * ca.MX.eye(self.problem.size)
        return derivative("hess_lag", [self.x, self.parameters, lam_f, lam_g], [hessian])

    @property
    def _cost(self) -> ca.MX:
        return ca.MX(self.weight / 2 * ca.sumsqr(self.away))


def regularised_hessian(hess_lag: ca.Function) -> ca.Function:
    """(x, p, lam_f, lam_g) -> upper triangle (n, n) of the regularised Hessian."""
    at = hess_lag.mx_in()
    hessian = hess_lag(*at) + REGULARISATION * ca.MX.eye(hess_lag.size1_out(0))
    return ca.Function("hess_lag", at, [hessian], hess_lag.name_in(), hess_lag.name_out())
