"""One bench log, prepared for prediction: commands, and position and velocity of the imposed motion
from a noisy, jittering position sensor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np
from scipy.linalg import toeplitz
from scipy.ndimage import maximum_filter1d

from kemba.effects.mechanics.piston import V_COULOMB
from kemba.effects.pneumatics.switching import Pulse, pulses
from kemba.identify.logs.gate import ROW
from kemba.identify.logs.local_fit import local_fit, weights
from kemba.identify.logs.reading import held
from kemba.identify.problem.noise import (
    ChannelNoise,
    ColourSettings,
    difference_sigma,
    learnt_noise,
    pairs,
    telling,
)
from kemba.identify.problem.problem import Array, Flags
from kemba.trajectory import Trajectory

# How the velocity of an imposed motion is found.
FINEST = 2e-6  # smallest noise of the position sensor [m]
# half widths, in samples, of the windows that are tried: each about 1.4 times the one before
HALF_WIDTHS = (5, 8, 11, 15, 20, 27, 40, 60, 90, 135)
MEASURED = 0.5  # share of valid readings that a measured velocity needs
WIDTH = 6  # half width, in samples, of its smoothing
FINEST_SPEED = 1e-6  # smallest noise of a velocity sensor [m.s-1]
CONTRADICTS = 3.0  # sigmas by which a measured velocity may differ: three sigmas


@dataclass(frozen=True)
class SmoothedMotion:
    """x [m], v [m.s-1], a [m.s-2] at `time` (n,) [s], and one sigma of v (n,)."""

    time: Array
    x: Array
    v: Array
    a: Array
    v_sigma: Array
    x_sigma: float


def smooth_motion(
    time: Array, x: Array, v: Array | None = None, noise: ChannelNoise | None = None
) -> SmoothedMotion:
    """Position and velocity from local cubics, each over the window of least expected error.

    `time`, `x` and `v` are (n,). At rest the window is wide, so that noise does not look like slow
    motion. In fast motion it is narrow, so that peaks of the velocity are kept. A measured `v`
    [m.s-1] is averaged with the derived one, by their errors. `noise` of the position sensor, in
    `difference_sigma` of x; None: white.
    """
    good = np.isfinite(x)
    noise = noise or ChannelNoise()
    grid, values, step = _even_grid(time, x)
    sigma = max(difference_sigma(x[good]), FINEST)
    position, rate, spread = _adaptive(values, sigma, step, noise)
    if v is not None and np.isfinite(v).sum() > MEASURED * len(v):
        rate, spread = _weigh_in(grid, rate, spread, time, v)
    a = np.gradient(_mean(rate, 3), step)
    x, v, a, spread = (np.interp(time, grid, c) for c in (position, rate, a, spread))
    return SmoothedMotion(time, x, v, a, spread, sigma * noise.spread)


def _even_grid(time: Array, x: Array) -> tuple[Array, Array, float]:
    """Even times (m,) [s], x (m,) there, rows without a value bridged, and the step [s]."""
    good = np.isfinite(x)
    step = float(np.median(np.diff(time)))
    count = max(int(np.ceil((time[-1] - time[0]) / step)) + 1, 8)
    grid = np.linspace(time[0], time[-1], count)
    return grid, np.interp(grid, time[good], x[good]), float(grid[1] - grid[0])


def _adaptive(
    values: Array, sigma: float, step: float, colour: ChannelNoise
) -> tuple[Array, Array, Array]:
    """Position, rate, its error, over windows of least risk: the quintic tells the cubic's bias."""
    n = len(values)
    best = np.full(n, np.inf)
    position, rate = values.copy(), np.zeros(n)
    for width in HALF_WIDTHS:
        if 2 * width + 1 > n:
            break
        x, v = (local_fit(values, width, step, 3, k) for k in (0, 1))
        finer = local_fit(values, width, step, 5, 1)
        at = np.minimum(np.arange(n), width) + np.maximum(np.arange(n) - (n - 1 - width), 0)
        gain, finer_gain = (_slope_sigma(width, step, order, colour)[at] for order in (3, 5))
        noise = (sigma * gain) ** 2
        bias = _mean((finer - v) ** 2, max(width // 2, 2)) - (sigma * finer_gain) ** 2 + noise
        risk = noise + np.maximum(bias, 0.0)
        better = risk < best
        position[better], rate[better] = x[better], v[better]
        best[better] = risk[better]
    return position, _mean(rate, 1), np.sqrt(best)


@lru_cache(maxsize=256)
def _slope_sigma(width: int, step: float, order: int, colour: ChannelNoise) -> Array:
    """1 sigma [s-1] of `local_fit`'s slope per stated sigma at each place of the window."""
    slope = weights(width, order, 1)
    if not colour.lags:
        return np.asarray(colour.white * np.linalg.norm(slope, axis=1) / step)
    covariance = toeplitz(colour.covariance(step * np.arange(2.0 * width + 1.0)))
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", slope, slope @ covariance)) / step)


def _weigh_in(
    grid: Array, rate: Array, spread: Array, time: Array, v: Array
) -> tuple[Array, Array]:
    """Measured and derived velocity by their errors; the derived one where they contradict."""
    good = np.isfinite(v)
    measured = np.interp(grid, time[good], v[good])
    sigma = max(difference_sigma(v[good]), FINEST_SPEED)
    smoothed = _mean(measured, WIDTH)
    sd = np.full(len(grid), sigma / np.sqrt(2 * WIDTH + 1))
    gap = np.median(np.abs(smoothed - rate) / np.hypot(sd, spread))
    if gap > CONTRADICTS:
        return rate, spread
    weight = spread**2 / (spread**2 + sd**2)
    return rate + weight * (smoothed - rate), np.sqrt(weight) * sd


def _mean(values: Array, width: int) -> Array:
    """Moving average over 2 width + 1 samples, shrinking at the ends."""
    kernel = np.ones(2 * width + 1)
    return np.convolve(values, kernel, "same") / np.convolve(np.ones(len(values)), kernel, "same")


# Where the piston rests, and what is believed of the noise there.
QUIET_WIDTH = 135  # half width, in samples, of the cubic
REST = 2e-3  # speed up to which the piston rests [m.s-1]
# largest noise that is believed, in sigmas told from differences of rows: third differences
# show a tenth of AR(1) noise of 0.98 per row
MOST = 10.0


def position_noise(logs: Sequence[tuple[Array, Array]]) -> ChannelNoise:
    """Noise of the position sensor that all `logs` (times [s] and positions [m], both (n,)) share,
    in each log's `difference_sigma`; white where the piston rests too little to tell."""
    quiet = [found for time, x in logs if (found := _quiet(time, x)) is not None]
    if not quiet:
        return ChannelNoise()
    errors = np.full((max(len(left) for left, _ in quiet), len(quiet), 1), np.nan)
    for i, (left, _) in enumerate(quiet):
        errors[: len(left), i, 0] = left
    step = float(np.median([step for _, step in quiet]))
    made = {(0, memory): _expected(memory, step) for memory in (0.0, *ColourSettings.memories)}
    return learnt_noise(errors, pairs(errors), made, np.array([MOST]))[0]


def _quiet(time: Array, x: Array) -> tuple[Array, float] | None:
    """What the cubic leaves (n,) of x, in sigmas, NaN where it moves, and the step [s]; None of a
    log that is too short."""
    grid, values, step = _even_grid(time, x)
    if len(grid) < 2 * QUIET_WIDTH + 1:
        return None
    smooth, v = (local_fit(values, QUIET_WIDTH, step, 3, k) for k in (0, 1))
    rest = maximum_filter1d(np.abs(v), 2 * QUIET_WIDTH + 1) < REST
    rest[:QUIET_WIDTH] = rest[-QUIET_WIDTH:] = False
    sigma = max(difference_sigma(x[np.isfinite(x)]), FINEST)
    return np.where(rest, (values - smooth) / sigma, np.nan), step


def _expected(memory: float, step: float) -> Array:
    """Autocovariances (1, lags) of what the cubic leaves of unit noise with this memory [s]."""
    width, lags = QUIET_WIDTH, np.array(ColourSettings.lags)
    left = np.eye(1, 4 * width + 1, 2 * width)[0]
    left = left - local_fit(left, width, 1.0, 3)  # the filter's answer to one reading
    reach = np.convolve(left, left[::-1])
    apart = np.arange(len(reach)) - len(left) + 1
    noise = ChannelNoise(0.0, ((1.0, memory),)) if memory else ChannelNoise()
    found = [reach @ noise.covariance(step * (apart - lag)) for lag in lags]
    return np.array(found)[None, :]


Pulses = tuple[list[Pulse], list[Pulse]]  # of the extend and the retract valve
PRESSURES = ("chamber/extend/P", "chamber/retract/P")


# How a bench log is prepared.
FINEST_FORCE = 0.2  # smallest noise of the force sensor [N]
FINEST_PRESSURE = 100.0  # smallest noise of a pressure sensor [Pa]
FINEST_SHARE = 5e-4  # noise that is added, as a share of a channel's range
GAP = 0.012  # longest gap of the position that is bridged [s]
# time after which chambers do not depend on the moment of a switching [s]: three times the
# slowest rise time of Table I
MEMORY = 0.12
NEIGHBOURS = 9  # samples over which the largest error of the velocity counts
# usual damping, by which an error of the velocity makes one of the force [N.s.m-1]
DAMPING = 60.0
# usual friction of a cylinder, in doubt where the direction of motion is in doubt [N]: the
# tables of the paper imply 6 to 8 N
FRICTION = 10.0
CREEPING = 200.0  # damping that a slow piston has in addition [N.s.m-1]
CREEP = 0.08  # speed up to which it has it [m.s-1]


@dataclass(frozen=True)
class BenchLog:
    """One bench log, prepared: motion, commands, and the measured channels.

    `seen_within` [s]: time between the rows of a slow log, within which the moment of a command is
    not known; 0 for a usual log. `by_timing`: variance (n,) that this makes, by channel.
    """

    name: str
    motion: SmoothedMotion
    commands: Pulses
    measured: dict[str, Array]
    sigma: dict[str, float]
    mode: np.ndarray
    keep: dict[str, np.ndarray] = field(default_factory=dict)
    seen_within: float = 0.0
    by_timing: dict[str, Array] = field(default_factory=dict)

    def variance(self, channel: str) -> Array:
        """Variance (n,) of a channel's readings: white noise, and that of the switching times."""
        white = np.full(len(self.motion.time), self.sigma[channel] ** 2)
        return white + self.by_timing.get(channel, 0.0)

    def sent(self, late: float) -> BenchLog:
        """The same log with commands that were sent `late` [s] against what is known of them."""
        extend, retract = ([(a + late, b + late) for a, b in c] for c in self.commands)
        return replace(self, commands=(extend, retract))

    @cached_property
    def velocity_error(self) -> Array:
        """Force error (n,) [N] that the error of the velocity makes, alike for every hypothesis:
        damping, and a friction of usual size where the direction of motion is in doubt."""
        v, sigma = self.motion.v, maximum_filter1d(self.motion.v_sigma, NEIGHBOURS)
        high, low = np.tanh((v + 2 * sigma) / V_COULOMB), np.tanh((v - 2 * sigma) / V_COULOMB)
        slope = DAMPING + CREEPING * np.exp(-((v / CREEP) ** 2))
        return np.asarray(slope * self.motion.v_sigma + 0.5 * FRICTION * (high - low))


def prepare(
    name: str, log: Trajectory, noise: ChannelNoise | None = None, on_rows: bool = False
) -> BenchLog:
    """Smooth the motion and learn each channel's white noise from its fastest differences.

    `noise` of the position sensor, in sigmas of its white noise; None: white. `on_rows`: valves
    switch at the rows that show it, however slow the log is, as where rows of a test are left out.
    """
    speed = {"v": log["piston/v"]} if "piston/v" in log else {}
    motion = smooth_motion(log.time, log["piston/x"], noise=noise, **speed)
    sent = [held(log[f"valve/{c}"]) for c in ("extend", "retract")]
    measured = {c: log[c] for c in ("piston/F", *PRESSURES) if c in log}
    sigma = {c: _noise_of(c, y) for c, y in measured.items()}
    on = [(u > 0.5).astype(int).astype(str) for u in sent]
    known = ~_unpredictable(log.time, np.isfinite(log["piston/x"]), np.stack(sent))
    keep = {c: np.isfinite(y) & known & telling(y, sigma[c]) for c, y in measured.items()}
    row = float(np.median(np.diff(log.time)))  # within long ones valve edges are blurred
    within = row if row > ROW and not on_rows else 0.0
    # a change that a row shows happened since the row before
    seen = np.concatenate([log.time[:1], 0.5 * (log.time[1:] + log.time[:-1])])
    extend, retract = (pulses(seen if within else log.time, u) for u in sent)
    modes = np.char.add(*on)
    return BenchLog(name, motion, (extend, retract), measured, sigma, modes, keep, within)


def _noise_of(channel: str, y: Array) -> float:
    """White noise (1 sigma) of a sample of y (n,); not zero even in a simulation without noise."""
    least = FINEST_FORCE if channel == "piston/F" else FINEST_PRESSURE
    spread = float(np.ptp(y[np.isfinite(y)]))
    return max(difference_sigma(y), least + FINEST_SHARE * spread)


def _unpredictable(time: Array, good: Flags, sent: Array) -> Flags:
    """Rows (n,) in and just after gaps; longer where a valve switched within, unknown when."""
    known = np.flatnonzero(good)
    wide = np.flatnonzero(np.diff(time[known]) > GAP)
    hidden = np.zeros(len(time), dtype=bool)
    for begin, end in zip(known[wide], known[wide + 1], strict=True):
        switched = np.any(sent[:, begin] != sent[:, end])
        after = time[end] + (MEMORY if switched else GAP)
        hidden |= (time > time[begin]) & (time < after)
    return hidden
