#!/usr/bin/env bash
# scipy's curve_fit and least_squares: a leak of 1e-9 in SI units is fitted wrongly as soon as
# bounds are given, however wide, and its pressure is known to 1e-24 Pa.
#
# Guess, written before the run: the step for slopes is relative, x * diff_step as the
# documentation says, with 1.5e-8 by default; bounds that nothing touches change no digit; "success"
# has converged.
#
# Seen (scipy 1.17.1): a chamber of 0.5 l leaks from 7 bar with 1e-9 kg/(s Pa), 500 Pa of noise.
# - curve_fit without bounds (MINPACK, whose steps are relative) finds 1.000e-9 +- 2e-13 from any
#   start. With bounds of 0 and 1e-6 least_squares does it and finds 0.90e-9 from 1.1e-9, 1.13e-9
#   from 2e-9 and the start itself from 0.5e-9, without a word. Its default step is
#   1.5e-8 * max(1, |x|): fifteen times the leak, and the slope is that of a chord.
# - least_squares itself returns its start, "success": no step by such slopes lowers the cost, and
#   steps shrink until they are below xtol.
# - diff_step=1.5e-8, the default's own number, is relative and gives 1.000e-9 in both.
# - With bounds the first pressure is +- 4e-28 Pa, after that right fit too, instead of +- 50: beside
#   the leak's column in the Jacobian its own is so small that pcov takes it for rank lost. The
#   leak's error is too small by 1.6 then.
# In bar and 1e-9 kg/(s Pa) all of it is right.
#
# Why it matters: sonic conductances are of 1e-8, leaks of 1e-10, and bounds are set because both
# are positive. The fit looks poor, which is laid to the model, or its tiny errors are believed. Fit
# numbers near one: diff_step mends the fit and not the errors.
#
# Read: scipy's documentation of least_squares and curve_fit, its issues 11258 and 18161.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet scipy==1.17.1 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import numpy as np
import scipy
from scipy.optimize import curve_fit, least_squares

print("scipy", scipy.__version__)
RT_V = 287.0 * 293.0 / 5e-4  # Pa per kg
TRUE, BOUNDS = (7e5, 1e-9), ([0, 0], [1e6, 1e-6])
time = np.linspace(0, 6, 601)


def chamber(time, first, leak):
    """Pressure in Pa of a chamber with a laminar leak to the air."""
    return 1e5 + (first - 1e5) * np.exp(-leak * RT_V * time)


def scaled(time, first, leak):
    """The same with bar and 1e-9 kg/(s Pa)."""
    return chamber(time, first * 1e5, leak * 1e-9) / 1e5


log = chamber(time, *TRUE) + np.random.default_rng(0).normal(0, 500, time.size)
ways = {
    "no bounds": {},
    "bounds": {"bounds": BOUNDS},
    "bounds, diff_step=1.5e-8": {"bounds": BOUNDS, "diff_step": 1.5e-8},
}
found, errors = {}, {}
for leak in (0.5e-9, 1.1e-9, 2e-9):
    for words, options in ways.items():
        x, cov = curve_fit(chamber, time, log, p0=(6.5e5, leak), **options)
        found[words, leak], errors[words, leak] = x, np.sqrt(np.diag(cov))
    x, cov = curve_fit(scaled, time, log / 1e5, p0=(6.5, leak * 1e9), bounds=([0, 0], [10, 1000]))
    units = np.array([1e5, 1e-9])
    found["scaled", leak], errors["scaled", leak] = x * units, np.sqrt(np.diag(cov)) * units
    fit = least_squares(lambda x: chamber(time, *x) - log, (6.5e5, leak))
    if not fit.success:
        sys.exit("changed: least_squares no longer claims success")
    found["least_squares", leak], errors["least_squares", leak] = fit.x, (np.nan, np.nan)
for (words, leak), x in found.items():
    first, second = errors[words, leak]
    print(
        f"from {leak:.1e}, {words:24s}: leak {x[1]:.3e} +- {second:.1e} kg/(s Pa),"
        f" pressure {x[0] / 1e5:.3f} bar +- {first:.1e} Pa"
    )

for leak in (0.5e-9, 1.1e-9, 2e-9):
    for words in ("no bounds", "bounds, diff_step=1.5e-8", "scaled"):
        if not np.allclose(found[words, leak], TRUE, rtol=1e-3, atol=0):
            sys.exit(f"changed: the right fits, {words} from {leak}")
        first, second = errors[words, leak]
        if words.startswith("bounds"):
            if first > 1e-6 or not 1e-13 < second < 1.3e-13:
                sys.exit("changed: errors of a right fit with bounds")
        elif not (45 < first < 55 and 1.7e-13 < second < 2.1e-13):
            sys.exit(f"changed: errors, {words} from {leak}")
    if not np.array_equal(found["least_squares", leak], (6.5e5, leak)):
        sys.exit("changed: least_squares now leaves its start")
wrong = [found["bounds", leak][1] * 1e9 for leak in (0.5e-9, 1.1e-9, 2e-9)]
if not np.allclose(wrong, [0.5, 0.90, 1.13], rtol=0.02):
    sys.exit("changed: fits with bounds that are not touched")
EOF
