"""A little of the identity in the Hessian, so that Newton steps seldom must be computed twice.

Relaxed pairs give the Lagrangian negative curvature wherever one is active. IPOPT then finds the
wrong inertia, adds a multiple of the identity and factorises again, in three of four iterations;
and it begins every iteration without one. So it is added at once. This changes the iterates, not
the solution.
"""

from __future__ import annotations

import casadi as ca

from kemba.ocp.functions.settings import Newton


def regularised_hessian(hess_lag: ca.Function) -> ca.Function:
    """(x, p, lam_f, lam_g) -> upper triangle (n, n) of the regularised Hessian."""
    at = hess_lag.mx_in()
    hessian = hess_lag(*at) + Newton.current().regularisation * ca.MX.eye(hess_lag.size1_out(0))
    return ca.Function("hess_lag", at, [hessian], hess_lag.name_in(), hess_lag.name_out())
