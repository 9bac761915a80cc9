#!/usr/bin/env bash
# scipy.signal.decimate takes 1.15 % off every level: a sensor's scale error that is nobody's.
#
# Guess, written before the run: decimate by 10 leaves a position with an offset as it is, but for
# its ends, within 1 % of the offset.
#
# Seen (scipy 1.17.1): the default filter is a Chebyshev filter of order 8 with 0.05 dB of ripple.
# Of even order it has its ripple's bottom at zero frequency, and it runs there and back: 0.1 dB, so
# any constant comes out as 0.98855 of itself, at each q and each length. 600 kPa become 593.1 kPa.
# Order 7 keeps levels. ftype="fir" keeps them in the middle and halves them at the ends, as it
# reckons with zeros beyond the record.
#
# Why it matters: rigs record at 10 kHz and fits read at 1 kHz. A supply at rest reads 1 % low, and
# a fit of area or gain finds 1 % between channels that went through decimate and others that did
# not; gains of 1.009 and 1.013 between force and pressure times area (benchmarks/pages/real-data.md) are of
# this size. Channels that all went through it agree with each other and with no scale.
#
# Read: SciPy's reference of decimate (filter named, gain not), of cheby1 (even orders: gain below 1
# at zero frequency); SciPy's issues 9402 and 17042 (open).
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet scipy==1.17.1 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import numpy as np
import scipy
from scipy import signal

print("scipy", scipy.__version__)
time = np.arange(0, 2, 1e-4)
pressure = np.full(time.size, 600.0)
pressure[time > 1] += 20 * np.sin(2 * np.pi * 3 * time[time > 1])

levels = {}
for q in (2, 5, 10):
    thin = signal.decimate(pressure, q)
    levels[q] = thin[thin.size // 4] / 600
    print(f"q = {q:2d}: at rest {thin[thin.size // 4]:.2f} kPa of 600, share {levels[q]:.5f}")
swing = np.ptp(signal.decimate(pressure, 10)[12000 // 10 : 18000 // 10]) / np.ptp(
    pressure[12000:18000]
)
odd = signal.decimate(pressure, 10, n=7)
straight = signal.decimate(pressure, 10, ftype="fir")
print(f"swing of 20 kPa at 3 Hz comes out as a share of {swing:.5f}")
print(f"order 7: at rest {odd[odd.size // 4]:.2f} kPa")
print(f"fir: first row {straight[0]:.1f} kPa, at rest {straight[straight.size // 4]:.2f} kPa")

if not all(abs(share - 10 ** (-0.1 / 20)) < 1e-4 for share in levels.values()):
    sys.exit("changed: decimate no longer takes 0.1 dB off a level")
if abs(odd[odd.size // 4] - 600) > 0.01 or abs(straight[straight.size // 4] - 600) > 0.01:
    sys.exit("changed: an odd order or a FIR filter no longer keeps the level")
if straight[0] > 400:
    sys.exit("changed: a FIR filter no longer reckons with zeros before the record")
EOF
