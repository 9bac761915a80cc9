#!/usr/bin/env bash
# Gradients through CasADi's cvodes: the state is integrated to 1e-10, the gradient to no tolerance.
#
# Guess, written before the run: the Jacobian of cvodes in one to six parameters at once equals the
# directions one by one, to tolerance.
#
# Seen (casadi 3.8.2): forward mode does. Reverse mode, which gradient() takes, and jacobian() where
# parameters outnumber outputs, is off at any tolerance. A parameter's gradient is a quadrature
# along the adjoint, and quad_err_con is off by default: steps are chosen for the adjoint alone.
# Where that is smooth and the forcing is not, the quadrature steps over it. A mass pushed by four
# sines of 3 to 12 Hz, tolerances 1e-10: gradients are 1.00, 0.95, 0.74 and 0.58 of the true ones. A
# damped pendulum pushed at 5 to 30 Hz, default tolerances: thousands of times too large, of either
# sign. quad_err_con=True mends both. Gradients through idas are off alike.
#
# Why it matters: valves are pulsed and measured pressures are fast; a fit of many parameters to a
# rig's run, or shooting over a profile of pressures, asks for just this gradient. Optimisers then
# stall or wander as with noise. Set quad_err_con, or check one gradient against one forward
# direction.
#
# Read: CasADi's reference of integrator (quad_err_con: "Should the quadratures affect the step size
# control"), its issue 4383 (seen there with three parameters and more), SUNDIALS' CVODES user guide
# (quadratures in error tests, off by default).
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
tight = {"abstol": 1e-10, "reltol": 1e-10}
x, t = ca.MX.sym("x", 2), ca.MX.sym("t")


def gradients(hertz, count, restoring, start, **options):
    """Slopes of the place after 1 s in the push's amplitudes, reverse and forward; the place."""
    p, wish = ca.MX.sym("p", count), ca.MX.sym("wish", count)
    push = sum(p[k] * ca.sin(2 * np.pi * hertz * (k + 1) * t + 0.3 * k) for k in range(count))
    law = {"x": x, "p": p, "t": t, "ode": ca.vertcat(x[1], push + restoring)}
    run = ca.integrator("run", "cvodes", law, 0, 1.0, options)
    place = run(x0=start, p=wish)["xf"][0]
    reverse = ca.Function("reverse", [wish], [ca.gradient(place, wish)])
    forward = ca.Function(
        "forward",
        [wish],
        [ca.horzcat(*(ca.jtimes(place, wish, ca.DM(np.eye(count)[:, k])) for k in range(count)))],
    )
    at = np.ones(count)
    slopes = [np.array(of(at)).ravel() for of in (reverse, forward)]
    return *slopes, lambda amplitudes: float(run(x0=start, p=amplitudes)["xf"][0])


mass = -0.5 * x[1]
reverse, forward, place = gradients(3, 4, mass, [0, 0], **tight)
exact = np.array([place(row) for row in np.eye(4)])
mended, _, _ = gradients(3, 4, mass, [0, 0], **tight, quad_err_con=True)
print("mass, linear in its pushes, tolerances 1e-10; share of the exact slopes:")
for name, row in (("forward", forward), ("reverse", reverse), ("reverse, quad_err_con", mended)):
    print(f"  {name:22s}", np.round(row / exact, 4))
pendulum = -9.81 * ca.sin(x[0]) - 0.2 * x[1]
swing, along, _ = gradients(5, 6, pendulum, [0.3, 0])
better, along_too, _ = gradients(5, 6, pendulum, [0.3, 0], quad_err_con=True)
print("pendulum, default tolerances; share of the forward slopes:")
print("  reverse               ", np.round(swing / along))
print("  reverse, quad_err_con ", np.round(better / along_too, 3))

if abs(forward / exact - 1).max() > 1e-4:
    sys.exit("changed: forward mode is no longer right")
if abs(reverse / exact - 1).max() < 0.05:
    sys.exit("changed: reverse mode at tolerances of 1e-10 is now right")
if abs(mended / exact - 1).max() > 1e-4:
    sys.exit("changed: quad_err_con no longer mends the gradient")
if abs(swing / along).max() < 10 or abs(better / along_too - 1).max() > 0.2:
    sys.exit("changed: the pendulum's gradient is now right, or quad_err_con no longer mends it")
EOF
