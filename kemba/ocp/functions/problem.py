"""What is asked of a nonlinear program's functions."""

from __future__ import annotations

from typing import Any, Protocol

import casadi as ca


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
