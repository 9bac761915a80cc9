"""A little of the identity in the Hessian, so that Newton steps seldom must be computed twice.

Relaxed pairs bend the Lagrangian downwards wherever one is active. IPOPT then finds the wrong
inertia, adds a multiple of the identity and factorises again, in three of four iterations; and it
begins every iteration with none. What is nearly always added may as well be there at once. It
changes the way, not the solution.
"""

from __future__ import annotations

import casadi as ca

DAMPING = 2e-3  # per scaled variable; IPOPT's own additions are 1e-4 to 1


def regularised_hessian(hess_lag: ca.Function) -> ca.Function:
    """(x, p, lam_f, lam_g) -> upper triangle of the Hessian (n, n), damped."""
    at = hess_lag.mx_in()
    hessian = hess_lag(*at) + DAMPING * ca.MX.eye(hess_lag.size1_out(0))
    return ca.Function("hess_lag", at, [hessian], hess_lag.name_in(), hess_lag.name_out())
