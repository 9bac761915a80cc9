"""Contacts of feet and end stops, read from the measured motion and never from a plan."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.ndimage import (
    binary_dilation,
    binary_erosion,
    binary_opening,
    gaussian_filter1d,
    maximum_filter1d,
    minimum_filter1d,
    uniform_filter1d,
)

from kemba.identify.logs.local_fit import local_fit
from kemba.identify.problem.problem import Array, Flags

# When a foot touches the ground, and when a piston rests at a stop.
# height below which a foot may touch [m]: a piston 0.5 mm wrong lifts the foot by 3 mm, a late
# encoder by 9 mm
MAY_TOUCH = 9.0e-3
LEVEL_SEARCH = 20e-3  # height of a resting foot that may mean the ground [m]
LEVEL_TIME = 0.5  # time over which the ground's reading may wander [s]: half a hop
LEVEL_RATE = 0.03  # vertical speed of a resting foot [m.s-1]
LEVEL_ROWS = 20  # rows at rest that give the ground's height
STANDS = 2.5e-3  # height above the ground of a standing foot [m]
TOUCHES = 1.5e-3  # the same for naming the phase only [m]
NEAR_STOP = 0.6e-3  # distance from a stop at which a piston may rest on it [m]
# the same in sigmas of the reading, where that is more; at most half of STOP_SEARCH: the
# extreme readings lie 2.5 sigmas before the stop, others 2.5 behind it
STOP_NOISE = 5.0
STOP_SEARCH = 2.5e-3  # distance from an end of the stroke at which the stop may be [m]
STOP_ROWS = 4  # extreme readings that are left out
BLUR = 0.003  # time around a contact in which it may be [s]
STRIKE = 0.025  # time in which a foot strikes the ground [s]
IMPACT = 0.005  # time that is called an impact [s]
SETTLED = 0.010  # time in contact before a foot's height is trusted [s]
SLOW_FOOT = 0.15  # vertical speed of a standing foot [m.s-1]
SLIDING = 0.1  # speed of a foot that slides [m.s-1]
STICKING = 0.04  # speed of a foot that sticks [m.s-1]
SLOW_BODY = 0.05  # speed of a body at rest [m.s-1]
SLOW_PISTON = 0.02  # speed of a piston at rest [m.s-1]
FIRM_LOAD = 15.0  # load of a foot whose sliding friction is judged [N]
LEAST_LOAD = 6.0  # load of a foot that is known to stand [N]
RATE_WINDOW = 0.02  # time over which rates are taken [s]
STEADY = 0.008  # time in which the push of a leg may change [s]


@dataclass(frozen=True)
class ContactSchedule:
    """Contacts of one run at its n nodes.

    Per leg, (n, legs): `foot`: it may touch the ground; `settled`: it rests on the ground;
    `struck`: it touched down a moment ago; `slides`: sign of its slip, 0 where it does not slide;
    `low`, `high`: the piston is at an end stop; `rests`: the piston has settled on a stop;
    `sticks`: the foot does not move along the ground. `phase` (n,): `rest`, `stance2`, `stance1`,
    `impact` or `flight`.
    """

    foot: Flags
    settled: Flags
    struck: Flags
    slides: Array
    low: Flags
    high: Flags
    phase: np.ndarray[Any, Any]
    rests: Flags
    sticks: Flags

    @property
    def held(self) -> Flags:
        """(n, 3 legs): places known to stand still; x and z of each foot, then the stops."""
        feet = np.stack([self.settled & self.sticks, self.settled], axis=-1)
        return np.hstack([feet.reshape(len(feet), -1), self.rests])


def read_schedule(
    time: Array, feet: Array, pistons: Array, stroke: float, body: Array, noise: Array
) -> ContactSchedule:
    """The schedule of one run at `time` (n,) [s].

    `feet` (n, legs, [x, z]) [m], `pistons` (n, legs) [m], `stroke` [m], `body` (n, 3): x, z [m] and
    pitch [rad]; `noise` (legs,): sigma of the pistons' readings [m].
    """
    dt = max(float(np.median(np.diff(time))), 1e-4)
    feet_rate, piston_rate = slope(feet, dt), slope(pistons, dt)
    speed = np.abs(slope(body, dt)).max(axis=1)
    blur, settle = max(1, round(BLUR / dt)), max(1, round(SETTLED / dt))
    near_stop = np.clip(STOP_NOISE * noise, NEAR_STOP, STOP_SEARCH / 2)
    z, vx, vz = feet[..., 1], feet_rate[..., 0], feet_rate[..., 1]
    level = np.array([ground_level(*leg) for leg in zip(z.T, vz.T, strict=True)])
    wandering = [_wandering_level(h, usual, dt) for h, usual in zip(z.T, level, strict=True)]
    ground = np.maximum(level, np.stack(wandering, axis=1))
    may, touches = _dilate(z < ground + MAY_TOUCH, blur), z < level + TOUCHES
    slow, slow_piston = np.abs(vz) < SLOW_FOOT, np.abs(piston_rate) < SLOW_PISTON
    struck = first_nodes(may, STRIKE / dt)
    on_ground = _erode(z < ground + STANDS, settle) & slow & ~struck
    slides = np.where(on_ground & (np.abs(vx) > SLIDING), np.sign(vx), 0.0)
    places = zip(pistons.T, slow_piston.T, strict=True)
    bottom, top = np.array([_stop_levels(x[still], stroke) for x, still in places]).T
    at_low = _closed(pistons < bottom + near_stop, settle)
    at_high = _closed(pistons > top - near_stop, settle)
    low, high = _dilate(at_low, 2), _dilate(at_high, 2)
    # an impact shakes all loads: what a foot carries then is not known well enough to be judged
    slides[(struck | first_nodes(low | high, STRIKE / dt)).any(axis=1)] = 0.0
    count = touches.sum(axis=1)
    phase = np.array(["flight", "stance1", "stance2"], dtype=object)[np.minimum(count, 2)]
    phase[(count == feet.shape[1]) & (speed < SLOW_BODY)] = "rest"
    phase[_dilate(first_nodes(touches, 1), round(IMPACT / dt)).any(axis=1)] = "impact"
    settled = _erode(z < level + STANDS, settle) & slow
    rests = _erode(at_low | at_high, 3 * blur) & slow_piston
    sticks = _erode(np.abs(vx) < STICKING, settle // 2)
    return ContactSchedule(may, settled, struck, slides, low, high, phase, rests, sticks)


def first_nodes(flags: Flags, steps: float) -> Flags:
    """Flags (n, legs) of the first `steps` nodes of each stretch in which `flags` hold."""
    begun, count = np.zeros((len(flags) + 1, flags.shape[1]), int), max(1, round(steps))
    begun[2:] = np.cumsum(flags[1:] & ~flags[:-1], axis=0)
    before = np.maximum(np.arange(1, len(begun)) - count, 0)
    return np.asarray(begun[1:] > begun[before])


def loaded(schedule: ContactSchedule, normal: Array, dt: float) -> ContactSchedule:
    """The same with only those feet settled that carry a load: `normal` (n, legs) in N, steady."""
    width = max(3, round(RATE_WINDOW / dt))
    firm = minimum_filter1d(normal, width, axis=0) > FIRM_LOAD
    slides = schedule.slides * firm
    for leg in slides.T:  # short slips do not count: a foot that lifts off drags for a moment
        leg *= binary_opening(leg != 0.0, np.ones(width, bool))
    return replace(schedule, settled=schedule.settled & (normal > LEAST_LOAD), slides=slides)


def steady(values: Array, dt: float) -> Array:
    """Forces or rates (n, ...), smoothed: changes from sample to sample are noise."""
    return np.asarray(gaussian_filter1d(values, STEADY / dt, axis=0))


def steady_while(values: Array, acts: Flags, dt: float) -> Array:
    """Forces (n, ...), smoothed over the rows in which they act; zero in the others."""
    weight = steady(acts.astype(float), dt)
    mean = steady(np.where(acts, values, 0.0), dt) / np.maximum(weight, 1e-12)
    return np.where(acts, mean, 0.0)


def slope(values: Array, dt: float) -> Array:
    """Rate of a noisy signal (n, ...) over a few hundredths of a second."""
    half = min(max(2, round(RATE_WINDOW / dt / 2)), (len(values) - 1) // 2)
    return local_fit(values, half, dt, 2, 1)


def ground_level(z: Array, rate: Array) -> float:
    """Height [m] at which a foot rests, from heights z (n,) and their `rate` (n,) [m.s-1].

    It need not be zero: sensors may be off by more than a centimetre.
    """
    resting = z[(np.abs(z) < LEVEL_SEARCH) & (np.abs(rate) < LEVEL_RATE)]
    if len(resting) <= LEVEL_ROWS:
        return 0.0
    low = float(np.quantile(resting, 0.1))
    return float(np.median(resting[resting < low + STANDS]))


def _wandering_level(z: Array, level: float, dt: float) -> Array:
    """Height (n,) [m] of the lowest readings around each row, near the usual `level`."""
    width = max(3, round(LEVEL_TIME / dt))
    calm = uniform_filter1d(z, max(3, round(RATE_WINDOW / dt)), mode="nearest")
    low = maximum_filter1d(minimum_filter1d(calm, width), width)
    return np.where(np.abs(low - level) < LEVEL_SEARCH, low, level)


def _stop_levels(x: Array, stroke: float) -> tuple[float, float]:
    """Readings [m] at both stops: extremes of x (n,) of a slow piston, near the ends."""
    ordered = np.sort(x)
    few = min(STOP_ROWS, len(x) - 1)
    if few < 0:
        return 0.0, stroke
    low, high = float(ordered[few]), float(ordered[-1 - few])
    low = low if abs(low) < STOP_SEARCH else 0.0
    return low, high if abs(high - stroke) < STOP_SEARCH else stroke


def _dilate(flags: Flags, steps: int) -> Flags:
    return np.asarray(binary_dilation(flags, np.ones((2 * steps + 1, 1), bool)))


def _closed(flags: Flags, steps: int) -> Flags:
    """Without gaps of up to 2 `steps` nodes: a reading that leaves the stop so shortly is noise."""
    return _erode(_dilate(flags, steps), steps)


def _erode(flags: Flags, steps: int) -> Flags:
    return np.asarray(binary_erosion(flags, np.ones((2 * steps + 1, 1), bool), border_value=1))
