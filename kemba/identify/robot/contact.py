"""Who touches what, and when: read from measured kinematics, never from a plan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import binary_dilation, binary_erosion
from scipy.signal import savgol_filter

Array = np.ndarray[Any, np.dtype[np.float64]]
Flags = np.ndarray[Any, np.dtype[np.bool_]]

NEAR_GROUND = 2.0e-3  # m above the level on which feet rest
NEAR_STOP = 0.4e-3  # m from the level at which pistons rest
BLUR = 0.004  # s by which contact is thought to begin earlier and end later
SETTLED = 0.010  # s within contact before a foot's height is trusted
SLOW_FOOT, SLIDING, SLOW_BODY, SLOW_PISTON = 0.15, 0.06, 0.05, 0.02  # m.s-1
RATE_WINDOW = 0.02  # s


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

    @property
    def held(self) -> Flags:
        """(n, 3 legs): places known to stand still; x and z of each foot, then the stops."""
        feet = np.stack([self.settled & (self.slides == 0.0), self.settled], axis=-1)
        return np.hstack([feet.reshape(len(feet), -1), self.rests])


def read_schedule(
    time: Array, feet: Array, pistons: Array, stroke: float, body: Array
) -> Schedule:
    """The schedule of one run from feet (n, legs, [x, z]), pistons (n, legs) and body (n, k)."""
    dt = max(float(np.median(np.diff(time))), 1e-4)
    feet_rate, piston_rate = slope(feet, dt), slope(pistons, dt)
    speed = np.abs(slope(body, dt)).max(axis=1)
    blur, settle = max(1, round(BLUR / dt)), max(1, round(SETTLED / dt))
    legs = range(feet.shape[1])
    touch, settled, struck, slides, low, high, rests = ([] for _ in range(7))
    for i in legs:
        z, vx, vz = feet[:, i, 1], feet_rate[:, i, 0], feet_rate[:, i, 1]
        raw = z < ground_level(z, vz) + NEAR_GROUND
        may = _dilate(raw, blur)
        begin = may & ~np.append(True, may[:-1])
        inner = _erode(raw, settle) & (np.abs(vz) < SLOW_FOOT)
        touch.append(may)
        struck.append(np.convolve(begin, np.ones(3 * blur), mode="full")[: len(z)] > 0)
        settled.append(inner)
        slides.append(np.where(inner & (np.abs(vx) > SLIDING), np.sign(vx), 0.0))
        bottom, top = stop_levels(pistons[:, i], stroke)
        at_low, at_high = pistons[:, i] < bottom + NEAR_STOP, pistons[:, i] > top - NEAR_STOP
        still = np.abs(piston_rate[:, i]) < SLOW_PISTON
        rests.append(_erode(at_low | at_high, 2 * blur) & still)
        low.append(_dilate(at_low, 2))
        high.append(_dilate(at_high, 2))
    may, hit = np.stack(touch, 1), np.stack(struck, 1)
    count = may.sum(axis=1)
    phase = np.array(["flight", "stance1", "stance2"], dtype=object)[np.minimum(count, 2)]
    phase[(count == may.shape[1]) & (speed < SLOW_BODY)] = "rest"
    phase[hit.any(axis=1)] = "impact"
    return Schedule(
        may,
        np.stack(settled, 1),
        hit,
        np.stack(slides, 1),
        np.stack(low, 1),
        np.stack(high, 1),
        phase,
        np.stack(rests, 1),
    )


def slope(values: Array, dt: float) -> Array:
    """Rate of a noisy signal (n, ...) over a few hundredths of a second."""
    window = min(2 * max(2, round(RATE_WINDOW / dt / 2)) + 1, (len(values) - 1) // 2 * 2 + 1)
    return np.asarray(savgol_filter(values, window, 2, deriv=1, delta=dt, axis=0))


def ground_level(z: Array, rate: Array) -> float:
    """Height at which a foot rests: sensors may be off by a millimetre or two."""
    resting = z[(z < 0.006) & (z > -0.006) & (np.abs(rate) < 0.03)]
    return float(np.clip(np.median(resting), -0.004, 0.004)) if len(resting) > 20 else 0.0


def stop_levels(x: Array, stroke: float) -> tuple[float, float]:
    """Readings at the two stops, as far as the piston ever rests there."""
    levels = []
    for end, sign in ((0.0, 1.0), (stroke, -1.0)):
        from_end = sign * (x - end)
        resting = from_end[np.abs(from_end) < 0.0025]
        level = float(np.quantile(resting, 0.1)) if len(resting) > 20 else 0.0
        levels.append(end + sign * min(level, 0.0015))
    return levels[0], levels[1]


def _dilate(flags: Flags, steps: int) -> Flags:
    return binary_dilation(flags, np.ones(2 * steps + 1, bool))


def _erode(flags: Flags, steps: int) -> Flags:
    return binary_erosion(flags, np.ones(2 * steps + 1, bool), border_value=1)
