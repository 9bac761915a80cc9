"""One bench log, prepared for prediction."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.ndimage import maximum_filter1d

from kemba.effects.mechanics.piston import V_COULOMB
from kemba.effects.pneumatics.switching import Pulse, pulses
from kemba.identify.bench.motion import SmoothedMotion, smooth_motion
from kemba.identify.logs.limits import ROW
from kemba.identify.logs.reading import held
from kemba.identify.problem.noise import difference_sigma, telling
from kemba.identify.problem.sensor_noise import ChannelNoise
from kemba.identify.problem.types import Array, Flags
from kemba.trajectory import Trajectory

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
    within = 0.0 if on_rows else _seen_within(log.time)
    # a change that a row shows happened since the row before
    seen = np.concatenate([log.time[:1], 0.5 * (log.time[1:] + log.time[:-1])])
    extend, retract = (pulses(seen if within else log.time, u) for u in sent)
    modes = np.char.add(*on)
    return BenchLog(name, motion, (extend, retract), measured, sigma, modes, keep, within)


def _seen_within(time: Array) -> float:
    """Time [s] between rows where it is so long that valve edges are blurred, else 0."""
    step = float(np.median(np.diff(time)))
    return step if step > ROW else 0.0


def _noise_of(channel: str, y: Array) -> float:
    """White noise (1 sigma) of a sample, from readings y (n,), in their unit.

    It is never below a small least noise, so that simulated logs without any noise can be judged.
    """
    least = FINEST_FORCE if channel == "piston/F" else FINEST_PRESSURE
    spread = float(np.ptp(y[np.isfinite(y)]))
    return max(difference_sigma(y), least + FINEST_SHARE * spread)


def _unpredictable(time: Array, good: Flags, sent: Array) -> Flags:
    """Rows (n,) that cannot be predicted: in and just after gaps of the position and of the time.

    Where a valve switched within a gap, the moment is not known. The rows after such a gap count
    again when the chambers no longer depend on that moment.
    """
    known = np.flatnonzero(good)
    wide = np.flatnonzero(np.diff(time[known]) > GAP)
    hidden = np.zeros(len(time), dtype=bool)
    for begin, end in zip(known[wide], known[wide + 1], strict=True):
        switched = np.any(sent[:, begin] != sent[:, end])
        after = time[end] + (MEMORY if switched else GAP)
        hidden |= (time > time[begin]) & (time < after)
    return hidden
