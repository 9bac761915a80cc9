"""Who touches what, and when: read from measured kinematics, never from a plan."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.ndimage import (
    binary_dilation,
    binary_erosion,
    binary_opening,
    gaussian_filter1d,
    minimum_filter1d,
)
from scipy.signal import savgol_filter

Array = np.ndarray[Any, np.dtype[np.float64]]
Flags = np.ndarray[Any, np.dtype[np.bool_]]

# A piston that reads half a millimetre wrong lifts the foot by three, a late encoder by nine: a
# foot this near may touch, which costs a few milliseconds of known flight.
MAY_TOUCH = 9.0e-3  # m
LEVEL_SEARCH = 20e-3  # m from nought in which a foot at rest may mean the ground
STANDS = 2.5e-3  # m above the level on which feet rest: may be standing
TOUCHES = 1.5e-3  # m above the level on which feet rest: for naming the phase only
NEAR_STOP = 0.6e-3  # m from the furthest reading near an end of the stroke
STOP_SEARCH = 2.5e-3  # m from an end of the stroke in which a reading may mean the stop
BLUR, STRIKE, IMPACT = 0.003, 0.025, 0.005  # s: around contact; in which it strikes; of an impact
SETTLED = 0.010  # s within contact before a foot's height is trusted
SLOW_FOOT, SLIDING, SLOW_BODY, SLOW_PISTON = 0.15, 0.1, 0.05, 0.02  # m.s-1
STICKING = 0.04  # m.s-1
FIRM_LOAD = 15.0  # N: of a foot whose sliding friction means something
LEAST_LOAD = 6.0  # N: a foot that carries less is not known to stand
RATE_WINDOW = 0.02  # s
STEADY = 0.008  # s: the push of a leg changes no faster


@dataclass(frozen=True)
class Schedule:
    """Of one run, per node: `foot` may touch (n, legs), `settled` on the ground (n, legs),
    `struck` touched down within a moment (n, legs), `slides` (n, legs; sign of the slip),
    `low`, `high` at an end stop (n, legs), `phase` (n,) as the contract names it."""

    foot: Flags
    settled: Flags
    struck: Flags
    slides: Array
    low: Flags
    high: Flags
    phase: np.ndarray[Any, Any]
    rests: Flags  # (n, legs): piston settled on a stop
    sticks: Flags  # (n, legs): foot that does not move along the ground

    @property
    def held(self) -> Flags:
        """(n, 3 legs): places known to stand still; x and z of each foot, then the stops."""
        feet = np.stack([self.settled & self.sticks, self.settled], axis=-1)
        return np.hstack([feet.reshape(len(feet), -1), self.rests])


def read_schedule(time: Array, feet: Array, pistons: Array, stroke: float, body: Array) -> Schedule:
    """The schedule of one run from feet (n, legs, [x, z]), pistons (n, legs) and body (n, k)."""
    dt = max(float(np.median(np.diff(time))), 1e-4)
    feet_rate, piston_rate = slope(feet, dt), slope(pistons, dt)
    speed = np.abs(slope(body, dt)).max(axis=1)
    blur, settle = max(1, round(BLUR / dt)), max(1, round(SETTLED / dt))
    legs: list[tuple[Any, ...]] = []
    for i in range(feet.shape[1]):
        z, vx, vz = feet[:, i, 1], feet_rate[:, i, 0], feet_rate[:, i, 1]
        level = ground_level(z, vz)
        near, touches = z < level + MAY_TOUCH, z < level + TOUCHES
        may = _dilate(near, blur)
        inner = _erode(z < level + STANDS, settle) & (np.abs(vz) < SLOW_FOOT)
        struck = _after(may, STRIKE / dt)
        slips = inner & touches & ~struck & (np.abs(vx) > SLIDING)
        slides = np.where(slips, np.sign(vx), 0.0)
        bottom, top = stop_levels(pistons[:, i], stroke)
        at_low, at_high = pistons[:, i] < bottom + NEAR_STOP, pistons[:, i] > top - NEAR_STOP
        rests = _erode(at_low | at_high, 3 * blur) & (np.abs(piston_rate[:, i]) < SLOW_PISTON)
        legs.append(
            (
                may,
                inner,
                struck,
                slides,
                _dilate(at_low, 2),
                _dilate(at_high, 2),
                rests,
                _erode(np.abs(vx) < STICKING, settle // 2),
                touches,
                _dilate(_after(touches, 1), round(IMPACT / dt)),
            )
        )
    *parts, touches, impact = (np.stack(part, axis=1) for part in zip(*legs, strict=True))
    may, settled, struck, slides, low, high, rests, sticks = parts
    count = touches.sum(axis=1)
    phase = np.array(["flight", "stance1", "stance2"], dtype=object)[np.minimum(count, 2)]
    phase[(count == feet.shape[1]) & (speed < SLOW_BODY)] = "rest"
    phase[impact.any(axis=1)] = "impact"
    return Schedule(may, settled, struck, slides, low, high, phase, rests, sticks)


def _after(flags: Flags, steps: float) -> Flags:
    """So many steps from where each stretch of `flags` begins."""
    begin = flags & ~np.append(True, flags[:-1])
    return np.asarray(np.convolve(begin, np.ones(max(1, round(steps))))[: len(flags)] > 0)


def loaded(schedule: Schedule, normal: Array, dt: float) -> Schedule:
    """The same with only those feet settled that carry a load: `normal` (n, legs) in N, steady."""
    width = max(3, round(RATE_WINDOW / dt))
    firm = minimum_filter1d(normal, width, axis=0) > FIRM_LOAD
    slides = schedule.slides * firm
    for leg in slides.T:  # a slip that lasts: a foot that just lifts off drags along for a moment
        leg *= binary_opening(leg != 0.0, np.ones(width, bool))
    return replace(schedule, settled=schedule.settled & (normal > LEAST_LOAD), slides=slides)


def steady(values: Array, dt: float) -> Array:
    """Forces or rates (n, ...) without what changes from sample to sample, which is noise."""
    return np.asarray(gaussian_filter1d(values, STEADY / dt, axis=0))


def slope(values: Array, dt: float) -> Array:
    """Rate of a noisy signal (n, ...) over a few hundredths of a second."""
    window = min(2 * max(2, round(RATE_WINDOW / dt / 2)) + 1, (len(values) - 1) // 2 * 2 + 1)
    return np.asarray(savgol_filter(values, window, 2, deriv=1, delta=dt, axis=0))


def ground_level(z: Array, rate: Array) -> float:
    """Height at which a foot rests: sensors may be off by more than a centimetre."""
    resting = z[(np.abs(z) < LEVEL_SEARCH) & (np.abs(rate) < 0.03)]
    if len(resting) <= 20:
        return 0.0
    low = float(np.quantile(resting, 0.1))
    return float(np.median(resting[resting < low + STANDS]))


def stop_levels(x: Array, stroke: float) -> tuple[float, float]:
    """Readings at the two stops: the furthest ones, where these are near an end at all."""
    ordered = np.sort(x)
    few = min(4, len(x) - 1)
    low, high = float(ordered[few]), float(ordered[-1 - few])
    low = low if abs(low) < STOP_SEARCH else 0.0
    return low, high if abs(high - stroke) < STOP_SEARCH else stroke


def _dilate(flags: Flags, steps: int) -> Flags:
    return np.asarray(binary_dilation(flags, np.ones(2 * steps + 1, bool)))


def _erode(flags: Flags, steps: int) -> Flags:
    return np.asarray(binary_erosion(flags, np.ones(2 * steps + 1, bool), border_value=1))
