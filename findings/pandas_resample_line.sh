#!/usr/bin/env bash
# pandas' resample().interpolate(): straight lines over rows, not over time, and a delay from none.
#
# Guess, written before the run: `interpolate()` counts rows and not time, as its documentation
# says, but after resample("5ms") the rows are equally spaced, so that it is the straight line.
#
# Seen (pandas 3.1.1): it counts the rows of raw samples and grid together, and takes the grid's
# rows afterwards. Between two samples the value moves by an equal part per row, wherever the rows
# are in time. The documentation's example has it so: from 1 at 0 s to -1 at 1 s, it prints 0.333 at
# 0.4 s, where the line is at 0.2.
# - A foot at 1 m/s, 100 Hz with stamps that wander by 2 ms: on a grid of 5 ms it is up to 3.3 mm
#   off, and its speed by differences is between 0.51 and 1.65 m/s.
# - One sine of 5 Hz, logged at 100 Hz by two boards 8 ms apart, in one frame: on a grid of 10 ms
#   the second's copy is 3.0 ms early: midway between its neighbours, whatever its stamps.
# - 1 kHz with half a second missing, on a grid of 10 ms: the gap's line is 8.8 ms early.
# interpolate("time") gives 0.2, the foot and the gap exactly, and the sine 0.02 ms off.
#
# Why it matters: this is the usual line that brings channels of a robot to one rate. Until 2.3 it
# dropped samples off the grid, which is seen at once; since pandas 3 it keeps them. Delays of
# valves are of this size, and so is the noise of speeds from which friction is fitted. Give the
# method: "time", or "index".
#
# Read: pandas' documentation of Resampler.interpolate and DataFrame.interpolate, its issue 21351.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet pandas==3.1.1 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import numpy as np
import pandas as pd

print("pandas", pd.__version__)
OMEGA = 2 * np.pi * 5.0


def channel(ms, values):
    return pd.Series(values, index=pd.to_timedelta(np.asarray(ms), unit="ms").round("us"))


def ms_of(series):
    return (series.index / pd.Timedelta("1ms")).to_numpy()


def delay(frame):
    """By how many ms the sine of 5 Hz is later in the first column than in the second."""
    inner = frame.iloc[20:-20]
    inner = inner.iloc[: len(inner) // 20 * 20]  # whole periods
    wave = np.exp(-1j * OMEGA * np.arange(len(inner)) * 0.01)
    first, second = (np.angle(inner[name].to_numpy() @ wave) for name in inner)
    return (second - first) / OMEGA * 1e3


wander = np.random.default_rng(0).uniform(-2.0, 2.0, 500)
foot = np.round(10.0 * np.arange(500) + wander, 3)
boards = [first + 10.0 * np.arange(1000) for first in (1.0, 9.0)]
sines = {f"board {i}": channel(ms, np.sin(OMEGA * ms / 1e3)) for i, ms in enumerate(boards)}
both = pd.concat(sines, axis=1)
gap = np.r_[0.4:100:1.0, 600.4:700:1.0]
seen = {}
for method in ("linear", "time"):
    line = channel([0, 1000], [1.0, -1.0]).resample("400ms").interpolate(method)
    walk = channel(foot, foot).resample("5ms").interpolate(method)  # 1 m/s: mm are ms
    speed = np.diff(walk) / 5.0
    hole = channel(gap, gap).resample("10ms").interpolate(method)
    seen[method] = (
        float(line.iloc[1]),
        float(np.abs(walk - ms_of(walk)).max()),
        float(np.ptp(speed)),
        float(delay(both.resample("10ms").interpolate(method))),
        float((hole - ms_of(hole)).max()),
    )
    print(
        f"{method:6s}: at 0.4 s {seen[method][0]:.3f}; foot {seen[method][1]:.2f} mm off,"
        f" speed {speed.min():.2f} to {speed.max():.2f} m/s;"
        f" delay {seen[method][3]:.2f} ms; in the gap {seen[method][4]:.1f} ms early"
    )

if not np.allclose(seen["time"], (0.2, 0, 0, 0, 0), atol=0.03):
    sys.exit("changed: interpolate('time') is no longer the straight line in time")
if np.allclose(seen["linear"], seen["time"], atol=0.03):
    sys.exit("changed: the default is now the straight line in time")
if not np.allclose(seen["linear"], (0.333, 3.26, 1.14, 3.0, 8.8), atol=0.05):
    sys.exit("changed: how far the default is from the line")
EOF
