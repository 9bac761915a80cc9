#!/usr/bin/env bash
# A map's last row, read by a B-spline, under IPOPT: the worst point is returned as the optimum.
#
# Guess, written before the run: outside its grid a B-spline `interpolant` goes on with the
# polynomial of its last piece, as scipy.interpolate.CubicSpline does; `linear` goes on with its
# last line.
#
# Seen (casadi 3.8.2 with its IPOPT; 3.6.7 alike): outside the grid the B-spline is 0 and so are its
# slopes. IPOPT widens bounds by bound_relax_factor (1e-8) before it begins, so the table's last row
# lies inside its box by a hair. Asked for the largest flow over an opening from 0 to 1 it answers
# `Solve_Succeeded`, opening 1.000000004, flow 0, from three starts. It crosses where the bound's
# multiplier exceeds about a quarter: the final barrier over 1e-8. The same map in other units can
# run into the iteration limit on the edge instead. With bounds kept, or one row beyond the bound,
# it finds the full flow.
#
# Why it matters: torque-speed maps of motors and flow maps of valves are tables that end at the
# bound, and full torque and full flow are what the best jumps ask for. Give tables a row beyond the
# bound; a plan that is feasible, converged and weak may stand on such an edge.
#
# Read: CasADi's reference of `interpolant` (nothing on points outside), IPOPT's options reference
# (bound_relax_factor, honor_original_bounds).
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet casadi==3.8.2 numpy==2.4.6 scipy==1.17.1
"$work/venv/bin/python" - <<'EOF'
import sys

import casadi as ca
from scipy.interpolate import CubicSpline

opening = [0.0, 0.25, 0.5, 0.75, 1.0]
flow = [0.0, 0.1, 0.35, 0.7, 1.0]
u = ca.MX.sym("u")
print("casadi", ca.__version__)


def at(kind, point):
    table = ca.interpolant("table", kind, [opening], flow)
    both = ca.Function("both", [u], [table(u), ca.jacobian(table(u), u)])(point)
    return tuple(round(float(part), 3) for part in both)


def largest(start, grid=opening, rows=flow, scale=1.0, **options):
    table = ca.interpolant("table", "bspline", [grid], [scale * row for row in rows])
    quiet = {"ipopt.print_level": 0, "print_time": 0, "ipopt.sb": "yes", **options}
    solver = ca.nlpsol("solver", "ipopt", {"x": u, "f": -table(u)}, quiet)
    found = solver(x0=start, lbx=0, ubx=1)
    return solver.stats()["return_status"], float(found["x"]), -float(found["f"]) / scale


outside = 1 + 1e-9
print("flow and slope at 1:        bspline", at("bspline", 1.0), "linear", at("linear", 1.0))
print(
    "flow and slope at 1 + 1e-9: bspline", at("bspline", outside), "linear", at("linear", outside)
)
print("scipy CubicSpline at 1 + 1e-9:", round(float(CubicSpline(opening, flow)(outside)), 3))
edge = [largest(start) for start in (0.1, 0.5, 0.9)]
scaled = largest(0.5, scale=200.0)
kept = largest(0.5, **{"ipopt.bound_relax_factor": 0.0})
longer = largest(0.5, [*opening, 1.25], [*flow, 1.1])
for name, seen in (
    *(("table ends at the bound", one) for one in edge),
    ("the same times 200", scaled),
    ("bounds not widened", kept),
    ("one row beyond", longer),
):
    print(f"{name:24s} {seen[0]}, opening {seen[1]:.9f}, share of full flow {seen[2]:.6f}")

if at("bspline", outside) != (0.0, 0.0):
    sys.exit("changed: a B-spline is no longer 0 outside its grid")
if not any(status == "Solve_Succeeded" and got == 0.0 for status, _, got in edge):
    sys.exit("changed: IPOPT no longer succeeds at flow 0 where the table ends at the bound")
if min(kept[2], longer[2]) < 0.9999:
    sys.exit("changed: bounds that are kept, or a row beyond them, no longer give the full flow")
EOF
