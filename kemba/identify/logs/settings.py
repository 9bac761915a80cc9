"""Limits of the checks that a log has to pass before anything is fitted."""

from __future__ import annotations

import math


class GateSettings:
    """When a log is refused."""

    shortest = 0.15  # a log must last at least so long [s]
    fewest = 60  # a log must have at least so many rows
    # largest median distance of rows [s]: 50 rows a second; chambers of Table I need 8 to 37 ms to
    # fill
    slowest = 0.02
    # median distance of rows that suggests a time in ms [s]: nobody logs at 2 Hz, 1 kHz is usual
    milliseconds = 0.5
    gaps = 0.5  # mean distance of rows that means long gaps [s]
    missing = 0.3  # share of readings of a needed column that may be missing
    impossible = 0.002  # share of impossible readings that a needed column may have
    impossible_elsewhere = 0.05  # the same for columns that are not needed
    # a valve column may be off 0 or 1 by this: a scaled voltage is off by a few per mille to a few
    # per cent
    valve = 0.02
    # readings beyond this, in the channel's SI unit, count as missing: a broken record, not a
    # measured value; its square would overflow
    absurd = 1e12
    quiet = 1e-4  # noise over range below which a channel counts as noiseless
    frozen = 40  # equal readings in a row that mean a dead sensor
    repeats = 0.2  # share of equal neighbours elsewhere that means a coarse sensor
    fastest = 8.0  # no piston moves faster [m.s-1]
    leap = 0.004  # a position may be off by this between two rows [m]
    calm = 0.3  # a leap stands beside steps of less than this share of the largest
    moves = 2e-3  # a position with less travel does not move [m]
    beyond = 0.015  # a position may read so far past the stroke [m]
    dead = 200  # rows without any change that mean a dead sensor


# Physical limits by the last part of the name: smallest, largest, and the likely mistake.
RANGES = {
    "piston/x": (-0.01, 1.0, "metres from 0 (retracted) to the stroke; is it in millimetres?"),
    "piston/v": (-8.0, 8.0, "metres per second; is it in mm/s?"),
    "piston/F": (-3000.0, 3000.0, "newtons, pushing positive"),
    "hip/q": (-2 * math.pi, 2 * math.pi, "radians; is it in degrees?"),
    "hip/tau": (-60.0, 60.0, "newton metres at the joint; is it in N.mm?"),
    "body/pitch": (-math.pi, math.pi, "radians, nose up positive; is it in degrees?"),
    "body/x": (-20.0, 20.0, "metres; is it in millimetres?"),
    "body/z": (-0.1, 3.0, "metres above the ground; is it in millimetres?"),
    "body/vx": (-20.0, 20.0, "metres per second"),
    "body/vz": (-20.0, 20.0, "metres per second"),
    "body/ax": (-2000.0, 2000.0, "metres per second squared"),
    "body/az": (-2000.0, 2000.0, "metres per second squared"),
    "P": (2e4, 2e6, "pascals, absolute; is it in bar or kPa, or gauge?"),
}


def range_of(name: str) -> tuple[float, float, str] | None:
    """Smallest and largest reading of a column, and the likely mistake; None where unknown."""
    return next((v for k, v in RANGES.items() if name == k or name.endswith(f"/{k}")), None)
