#!/usr/bin/env bash
# MDF: asammdf's resample delays scaled pressures by half a sample, and lets them fall before gaps.
#
# Guess, written before the run: a pressure that is stored as int16 with a linear conversion comes
# to a common raster by straight lines, as a float channel does, by to_dataframe and by resample
# alike; a 0/1 valve is held. Where invalidation bits are set, to_dataframe has NaN.
#
# Seen (asammdf 8.8.28; 8.0.1 alike), 100 Hz brought to 1 kHz:
# - to_dataframe draws straight lines for both channels; resample holds the scaled one, since it
#   takes every raw integer for a state, as the valve's. That pressure comes 4.5 ms late and up to
#   22.6 kPa off, the float channel beside it does not. configure(integer_interpolation=2) draws
#   lines for both, within one count.
# - to_dataframe fills a gap of 110 ms with a straight line and no NaN: it drops invalid rows first
#   and interpolates then.
# - resample draws a line to the number in the first invalid row and marks it valid. With 0 there
#   the pressure falls from 581 to 58 kPa in the 9 ms before the gap, in a chamber that never was
#   below 200 kPa, also in the file that is saved.
#
# Why it matters: loggers store pressures as scaled counts, and valves have delays of 5 ms. A fit
# finds one that is slow by half the logger's sample, in one channel and not in the next, and a
# chamber that vents within 10 ms before a dropout, which is what a stuck valve looks like.
# Interpolate what get() gives, which is converted and without invalid rows, and look at its times.
#
# Read: docstrings of resample and to_dataframe (nothing on either), of configure (modes of integer
# channels; holding is the default); asammdf's issue 735 (steps after resample, open).
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet asammdf==8.8.28 pandas==3.1.1 numpy==2.4.6
"$work/venv/bin/python" - "$work/rig.mf4" <<'EOF'
import sys

import asammdf
import numpy as np
from asammdf import MDF, Signal

path = sys.argv[1]
raster, unit = 0.001, 0.02
time = np.arange(200) / 100
print("asammdf", asammdf.__version__)


def pressure(at):
    return 400 + 200 * np.sin(4 * np.pi * at)


lost = (time >= 0.6) & (time < 0.7)
rig = MDF(version="4.10")
for signal in (
    Signal(
        np.round(pressure(time) / unit).astype(np.int16),
        time,
        name="counts",
        conversion={"a": unit, "b": 0.0},
    ),
    Signal(pressure(time), time, name="float"),
    Signal(np.where(lost, 0, pressure(time)), time, name="gap", invalidation_bits=lost),
    Signal((time % 0.2 < 0.1).astype(np.uint8), time, name="valve"),
):
    rig.append([signal])
rig.save(path, overwrite=True)

rig = MDF(path)
table, again = rig.to_dataframe(raster=raster), rig.resample(raster)
table.index = np.round(table.index, 6)
at = again.get("counts").timestamps
late = {}
for name in ("counts", "float"):
    samples = again.get(name).samples
    lags = np.arange(0, 0.012, 1e-4)
    late[name] = lags[np.argmin([np.std(samples - pressure(at - lag)) for lag in lags])]
    print(
        f"{name:6s} resample and to_dataframe differ by {np.abs(samples - table[name]).max():5.2f}"
        f" kPa at most, resample is {1e3 * late[name]:.1f} ms late"
    )
held = np.array_equal(again.get("valve").samples, table["valve"])
rig.configure(integer_interpolation=2)
mended = np.abs(rig.resample(raster).get("counts").samples - table["counts"]).max()
print(f"valve alike: {held}; with integer_interpolation=2 counts differ by {mended:.3f} kPa")

gap = table["gap"].loc[0.59:0.7]
straight = np.interp(gap.index, [0.59, 0.7], pressure(np.array([0.59, 0.7])))
lined = np.abs(gap - straight).max()
print(f"to_dataframe, the gap: {gap.isna().sum()} NaN, off a straight line by {lined:.1e} kPa")
again.save(path, overwrite=True)
saved = MDF(path).get("gap")
near = (saved.timestamps > 0.5885) & (saved.timestamps < 0.7005)
print("resampled and saved, valid rows from 0.589 s on:", np.round(saved.samples[near]), "kPa")
low = int(np.sum(saved.samples < 0.95 * pressure(saved.timestamps)))
print("rows that are valid and more than 5 % too low:", low)

if abs(late["counts"] - 0.0045) > 2e-4 or late["float"] > 2e-4:
    sys.exit("changed: resample no longer delays a scaled channel by half a sample")
if not held or mended > 1.01 * unit:
    sys.exit("changed: the valve is no longer held, or integer_interpolation=2 is no cure")
if gap.isna().any() or lined > 1e-6:
    sys.exit("changed: to_dataframe no longer fills a gap with a straight line")
if low != 9 or saved.samples.min() > 60:
    sys.exit("changed: resample no longer falls to the invalid number in valid rows")
EOF
