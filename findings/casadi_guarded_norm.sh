#!/usr/bin/env bash
# if_else guards slopes of sqrt, log and atan2, and not those of norm_2, solve and matrix products.
#
# Guess, written before the run: both branches of an if_else are evaluated, so at x = -1 if_else(x >
# 0, sqrt(x), 0) has value 0 and gradient nan, as 0 * nan.
#
# Seen (casadi 3.8.2 and 3.6.7): element-wise operations are guarded, first and second derivatives,
# SX and MX: if_else(x > 0, sqrt(x), 0) has slope 0 at -1. MX operations on whole vectors are not:
# if_else(|v| > 1e-9, norm_2(v), 0) at v = 0 has value 0, forward derivative 0 and gradient nan; the
# same line in SX has gradient 0, and so has MX with sqrt(sumsqr(v)) in place of norm_2(v). solve()
# and mtimes() in a branch behave as norm_2. A product with the condition instead of if_else is nan
# even as a value.
#
# Why it matters: directions of sliding and of cables are v / |v|, guarded at rest; robots rest at
# the start. A check of values and of forward derivatives passes, then IPOPT's gradient is nan at
# its first point, or not, by whether `expand` has turned the MX into SX before. Write
# sqrt(sumsqr(v)).
#
# Read: CasADi's reference of if_else (short_circuit), its issues 1805 and 1878.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet casadi==3.8.2 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import casadi as ca
import numpy as np

print("casadi", ca.__version__)
cases = {
    "sqrt(x)": lambda v: ca.if_else(v[0] > 0, ca.sqrt(v[0]), 0),
    "atan2(y, x)": lambda v: ca.if_else(ca.sumsqr(v) > 1e-18, ca.atan2(v[1], v[0]), 0),
    "sqrt(sumsqr(v))": lambda v: ca.if_else(ca.sumsqr(v) > 1e-18, ca.sqrt(ca.sumsqr(v)), 0),
    "norm_2(v)": lambda v: ca.if_else(ca.norm_2(v) > 1e-9, ca.norm_2(v), 0),
    "x / norm_2(v)": lambda v: ca.if_else(ca.norm_2(v) > 1e-9, v[0] / ca.norm_2(v), 0),
    "solve(diag(v), 1)": lambda v: ca.if_else(v[0] > 0, ca.solve(ca.diag(v), ca.DM([1, 1]))[0], 0),
}


def finite(symbols, law):
    """Whether value, forward derivative, gradient and Hessian at v = 0 are numbers."""
    v = symbols.sym("v", 2)
    branch = law(v)
    parts = [
        branch,
        ca.jtimes(branch, v, ca.DM([1, 1])),
        ca.gradient(branch, v),
        ca.hessian(branch, v)[0],
    ]
    return [
        bool(np.isfinite(np.array(part)).all()) for part in ca.Function("f", [v], parts)([0, 0])
    ]


print("numbers at v = 0:     value, forward, gradient, Hessian")
seen = {}
for name, law in cases.items():
    for symbols in (ca.SX, ca.MX):
        seen[name, symbols.__name__] = finite(symbols, law)
        print(
            f"{name:18s} {symbols.__name__}",
            *("yes" if one else "NAN" for one in seen[name, symbols.__name__]),
        )

whole = ("norm_2(v)", "x / norm_2(v)", "solve(diag(v), 1)")
for (name, kind), numbers in seen.items():
    expected = [True, True, False, False] if name in whole and kind == "MX" else [True] * 4
    if numbers != expected:
        sys.exit(f"changed: {name} in {kind} is now {numbers} instead of {expected}")
EOF
