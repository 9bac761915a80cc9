#!/usr/bin/env bash
# Derivatives of IPOPT's answer through CasADi: an error until multipliers of 1e-10 count as none.
#
# Guess, written before the run: jacobian() of the answer of nlpsol("ipopt") in its parameters is
# right to 1e-6, also with an active bound.
#
# Seen (casadi 3.8.2 and 3.6.7): for a quadratic program with finite bounds, none of them active,
# Jacobian and slope of the cost end in "Evaluation failed" and no further word. CasADi takes each
# bound with a multiplier other than 0 as active, up to option min_lam, which is 0; an
# interior-point method returns 1e-10 for all of them, so more rows than variables are active. With
# min_lam = 1e-8 derivatives are right. At a bound that is active by a hair, multiplier 1e-4,
# min_lam decides the answer: slope 0 below, slope 1 above, nothing between. sqpmethod, whose
# multipliers are exact zeros, needs no option.
#
# Why it matters: sensitivities of a plan to mass, pressure or friction are such derivatives. Set
# min_lam between the barrier's 1e-10 and the multipliers that mean something, and say which bounds
# were taken as active: at weakly active ones (valves at their stops) there are two slopes.
#
# Read: CasADi's reference of nlpsol (min_lam: "Minimum allowed multiplier value"), its issue 2660.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet casadi==3.8.2 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import casadi as ca
import numpy as np

x, p, wish = (ca.MX.sym(name, 2) for name in ("x", "p", "wish"))
program = {"x": x, "p": p, "f": ca.sumsqr(x - p), "g": x[0] + 2 * x[1]}
options = {
    "ipopt": {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": 0},
    "sqpmethod": {
        "qpsol": "qrqp",
        "qpsol_options": {"print_iter": False, "print_header": False},
        "print_header": False,
        "print_iteration": False,
        "print_status": False,
        "print_time": 0,
    },
}
print("casadi", ca.__version__)


def slopes(solver, upper, of="x", **more):
    """Slopes of the answer (or of the cost) in the wish for (2, 2), or the error's last line."""
    solve = ca.nlpsol("solve", solver, program, {**options[solver], **more})
    answer = solve(x0=0, p=wish, lbx=-9, ubx=[upper, 9], lbg=-9, ubg=9)
    slope = ca.Function("slope", [wish], [ca.jacobian(answer[of], wish), answer["lam_x"]])
    try:
        found, multipliers = slope([2, 2])
    except RuntimeError as error:
        return str(error).strip().splitlines()[-1].split(": ")[-1]
    return np.round(np.array(found), 4).tolist(), float(multipliers[0])


plain, cost = slopes("ipopt", 9), slopes("ipopt", 9, "f")
free, hard = slopes("ipopt", 9, min_lam=1e-8), slopes("ipopt", 1, min_lam=1e-8)
weak = [slopes("ipopt", 2 + 1e-5, min_lam=level) for level in (1e-8, 1e-3)]
exact = slopes("sqpmethod", 9)
for name, seen in (
    ("ipopt, no bound active", plain),
    ("ipopt, its cost", cost),
    ("ipopt, min_lam 1e-8", free),
    ("ipopt, min_lam 1e-8, x0 at its bound", hard),
    ("ipopt, min_lam 1e-8, bound at 2.00001", weak[0]),
    ("ipopt, min_lam 1e-3, bound at 2.00001", weak[1]),
    ("sqpmethod, no bound active", exact),
):
    print(f"{name:40s} {seen}")

if plain != "Evaluation failed" or cost != "Evaluation failed":
    sys.exit("changed: derivatives of IPOPT's answer no longer fail without min_lam")
identity = [[1.0, 0.0], [0.0, 1.0]]
if free[0] != identity or exact[0] != identity or hard[0] != [[0.0, 0.0], [0.0, 1.0]]:
    sys.exit("changed: derivatives with min_lam, or of sqpmethod, are no longer right")
if weak[0][0] == weak[1][0]:
    sys.exit("changed: min_lam no longer decides on a weakly active bound")
EOF
