"""What is asked of a nonlinear program and of its functions."""

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
