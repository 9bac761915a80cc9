#!/usr/bin/env bash
# Pyomo's Integral under collocation: a plan's cost that no control has, whatever the number of
# elements, and a control like a saw.
#
# Guess, written before the run: `pyomo.dae.Integral` is a trapezoid rule, as its documentation
# says, while the dynamics are of order five; with more elements both come to the same cost.
#
# Seen (pyomo 6.10.1, highspy 1.16.0): a mass of 1 kg goes 1 m from rest to rest in 1 s with the
# least integral of u^2; that is 12, with a straight u from 6 to -6. Under Radau collocation with
# three points the optimum is 10.77 with 5 elements, 10.79 with 20 and 10.80 with 40, "optimal" each
# time; the control goes 5.8, 4.8, 1.4, 3.3, 2.2, 0.4 and truly costs 12.4 to 12.5. In each element
# the trapezoid's weights are not those by which u moves the mass, however short it is, so
# refinement mends nothing; u at 0, which moves nothing, carries weight and becomes 0. Radau's own
# weights give 12 and the straight line with 5 elements. With five points per element the cost is
# 11.5, with three Legendre points 10.6. Under finite differences `CENTRAL` it is 0: odd and even
# points part.
#
# Why it matters: the objective of a plan (heat of a motor, air used) is what one reads off and
# compares. It is 10 % below what any control can do, the plan is 4 % worse than the best, and
# mesh refinement, the usual check, agrees with itself. Write the sum with the points' own weights,
# or make the cost a state.
#
# Read: Pyomo's documentation of pyomo.dae (Integral, collocation).
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet pyomo==6.10.1 highspy==1.16.0 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys
from importlib.metadata import version

import numpy as np
import pyomo.dae as dae
import pyomo.environ as pyo

ROOT = np.sqrt(6.0)
RADAU = np.array([16 - ROOT, 16 + ROOT, 4]) / 36  # weights of the three points, exact for u^2 here
print("pyomo", version("pyomo"), "highspy", version("highspy"))


def plan(elements, points=3, scheme="LAGRANGE-RADAU", own_weights=False):
    """Least integral of u^2 from rest to rest: Pyomo's cost, the true one, and the control."""
    m = pyo.ConcreteModel()
    m.t = dae.ContinuousSet(bounds=(0, 1))
    m.x, m.v, m.u = pyo.Var(m.t), pyo.Var(m.t), pyo.Var(m.t)
    m.dx, m.dv = dae.DerivativeVar(m.x), dae.DerivativeVar(m.v)
    m.speed = pyo.Constraint(m.t, rule=lambda m, t: m.dx[t] == m.v[t])
    m.force = pyo.Constraint(m.t, rule=lambda m, t: m.dv[t] == m.u[t])
    m.cost = dae.Integral(m.t, wrt=m.t, rule=lambda m, t: m.u[t] ** 2)
    if scheme == "CENTRAL":
        pyo.TransformationFactory("dae.finite_difference").apply_to(
            m, wrt=m.t, nfe=elements, scheme=scheme
        )
    else:
        pyo.TransformationFactory("dae.collocation").apply_to(
            m, wrt=m.t, nfe=elements, ncp=points, scheme=scheme
        )
    times = sorted(m.t)
    weights = np.resize(RADAU, len(times) - 1) / elements
    true = sum(w * m.u[t] ** 2 for w, t in zip(weights, times[1:], strict=True))
    m.least = pyo.Objective(expr=true if own_weights else m.cost)
    for variable, last in ((m.x, 1), (m.v, 0)):
        variable[0].fix(0)
        variable[1].fix(last)
    pyo.assert_optimal_termination(pyo.SolverFactory("highs").solve(m))
    control = [m.u[t].value for t in times if m.u[t].value is not None]
    if own_weights:
        return pyo.value(true), control
    three = (points, scheme) == (3, "LAGRANGE-RADAU")
    return pyo.value(m.cost), pyo.value(true) if three else None, control


seen = []
for elements in (5, 20, 40):
    cost, true, control = plan(elements)
    seen += [cost, true]
    print(f"{elements} elements: cost {cost:.2f}, truly {true:.2f}, u", np.round(control[:7], 1))
right, control = plan(5, own_weights=True)
print(f"5 elements, Radau's weights: {right:.4f}, u", np.round(control[:7], 1))
five, legendre = plan(20, points=5)[0], plan(20, scheme="LAGRANGE-LEGENDRE")[0]
central = plan(20, scheme="CENTRAL")[0]
print(f"20 elements: five points {five:.2f}, Legendre {legendre:.2f}, CENTRAL {central:.2f}")

if abs(right - 12) > 1e-4:
    sys.exit("changed: the program with Radau's own weights no longer gives 12")
if not np.allclose(seen, [10.77, 12.45, 10.79, 12.52, 10.80, 12.54], atol=0.01):
    sys.exit("changed: costs under Radau collocation")
if not np.allclose([five, legendre, central], [11.54, 10.65, 0], atol=0.01):
    sys.exit("changed: costs with other points and with central differences")
EOF
