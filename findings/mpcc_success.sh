#!/usr/bin/env bash
# "Solved" at points that are not stationary: what IPOPT and Uno say of a complementarity pair.
#
# Guess, written before the run: on a * b = 0 (or <= 0) with a, b >= 0 IPOPT reports success where
# the gradient of the Lagrangian, with the multipliers that it returns, is below 1e-8; Uno reports
# success at stationary points.
#
# Seen (casadi 3.8.2 with its IPOPT and Uno):
# - Both members want to be zero (cost (a + 1)^2 + (b + 1)^2): IPOPT says Solve_Succeeded with a
#   gradient of 0.64 and a multiplier of 2e10 to 3e10, as it divides the error by the mean
#   multiplier (s_max) and bounds the true one by dual_inf_tol = 1 only. Uno says "feasible KKT
#   point" with 0.67.
# - Neither wants to be zero (cost (a - 1)^2 + (b - 1)^2 in [0, 10]^2): from a = b = 1 IPOPT stops
#   at a = b = 0, cost 2, and either member alone could grow and bring it to 1. Gradient 4000,
#   multiplier 2e13, status Solved_To_Acceptable_Level (acceptable_dual_inf_tol is 1e10), and CasADi
#   counts that as success.
# - With dual_inf_tol = 1e-6 the first case is still a success: it becomes an acceptable level.
#
# Why it matters: contact force times gap is such a pair, and both are zero at touch-down and at
# lift-off. Solver status and inf_pr say nothing of optimality there. Judge a plan by the residual
# with its own multipliers, or by its branches: fix which member is zero and solve the smooth
# program.
#
# Read: IPOPT's options reference (tol, s_max, dual_inf_tol, acceptable_dual_inf_tol).
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet casadi==3.8.2 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import casadi as ca
import numpy as np

pair = ca.MX.sym("pair", 2)
product = pair[0] * pair[1]
print("casadi", ca.__version__)
silent = {
    "ipopt": {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": 0},
    "uno": {"uno": {"logger": "SILENT"}, "print_time": 0},
}


def solved(name, cost, start, upper=np.inf, **options):
    solver = ca.nlpsol(
        "solver", name, {"x": pair, "f": cost, "g": product}, {**silent[name], **options}
    )
    found = solver(x0=start, lbx=0, ubx=upper, lbg=0, ubg=0)
    slopes = ca.Function("slopes", [pair], [ca.gradient(cost, pair), ca.gradient(product, pair)])
    of_cost, of_product = slopes(found["x"])
    gradient = of_cost + of_product * found["lam_g"] + found["lam_x"]
    stats = solver.stats()
    seen = (stats["success"], float(ca.norm_inf(gradient)), float(found["f"]))
    print(
        f"{name:5s} from {start}: {stats['return_status']}, success {seen[0]},"
        f" gradient {seen[1]:.1e}, multiplier {float(found['lam_g']):.1e}, cost {seen[2]:.6f}"
    )
    return seen


print("both members want to be zero (least cost 2):")
both = (pair[0] + 1) ** 2 + (pair[1] + 1) ** 2
starts = ([0.0, 0.0], [1.0, 1.0], [0.3, 0.35])
ipopt = [solved("ipopt", both, start) for start in starts]
uno = [solved("uno", both, start) for start in starts]
strict = solved("ipopt", both, starts[0], **{"ipopt.dual_inf_tol": 1e-6})
print("neither wants to be zero (least cost 1):")
neither = (pair[0] - 1) ** 2 + (pair[1] - 1) ** 2
saddle = solved("ipopt", neither, [1.0, 1.0], 10.0)
branch = [solved("ipopt", neither, start, 10.0) for start in ([0.5, 2.0], [2.0, 0.5])]

if not any(success and gradient > 0.1 for success, gradient, _ in ipopt):
    sys.exit("changed: IPOPT no longer succeeds with a gradient of the Lagrangian near 1")
if not any(success and gradient > 0.1 for success, gradient, _ in uno):
    sys.exit("changed: Uno no longer succeeds with a gradient of the Lagrangian near 1")
if not (strict[0] and strict[1] > 0.1):
    sys.exit("changed: a strict dual_inf_tol no longer ends in success")
if not (saddle[0] and saddle[2] > 1.9 and min(cost for _, _, cost in branch) < 1.001):
    sys.exit("changed: IPOPT no longer succeeds where either member could grow")
EOF
