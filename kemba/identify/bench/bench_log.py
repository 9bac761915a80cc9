"""One bench log, prepared for prediction."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.ndimage import maximum_filter1d

from kemba.effects.mechanics.friction import V_COULOMB
from kemba.effects.pneumatics.switching import pulses
from kemba.identify.bench.motion import SmoothedMotion, smooth_motion
from kemba.identify.bench.rig_model import Pulses
from kemba.identify.evidence.noise import difference_sigma
from kemba.identify.evidence.problem import Array, Flags
from kemba.identify.logs.excerpt import held
from kemba.trajectory import Trajectory

PRESSURES = ("chamber/extend/P", "chamber/retract/P")
FINEST_FORCE, FINEST_PRESSURE = 0.2, 100.0  # N, Pa: noise that is never undercut
GAP, FORGET = 0.012, 0.12  # s
NEIGHBOURS = 9  # samples over which the worst error of the velocity counts
# usual figures of a cylinder of this size: N.s.m-1, N; and what friction adds below CREEP m.s-1
DAMPING, FRICTION = 60.0, 10.0
CREEPING, CREEP = 200.0, 0.08


@dataclass(frozen=True)
class BenchLog:
    """One bench log, prepared: motion, commands, and the measured channels."""

    name: str
    motion: SmoothedMotion
    commands: Pulses
    measured: dict[str, Array]
    sigma: dict[str, float]
    mode: np.ndarray
    keep: dict[str, np.ndarray] = field(default_factory=dict)

    @cached_property
    def blunt(self) -> Array:
        """Force error (n,) [N] that the error of the velocity makes: damping, and a friction of
        usual size where the direction of motion is in doubt. Alike for every hypothesis."""
        v, sigma = self.motion.v, maximum_filter1d(self.motion.v_sigma, NEIGHBOURS)
        high, low = np.tanh((v + 2 * sigma) / V_COULOMB), np.tanh((v - 2 * sigma) / V_COULOMB)
        slope = DAMPING + CREEPING * np.exp(-((v / CREEP) ** 2))
        return np.asarray(slope * self.motion.v_sigma + 0.5 * FRICTION * (high - low))


def prepare(name: str, log: Trajectory) -> BenchLog:
    """Smooth the motion and learn each channel's white noise from its fastest differences."""
    speeds = [log[name] for name in ("piston/v",) if name in log]
    motion = smooth_motion(log.time, log["piston/x"], *speeds)
    sent = [held(log[f"valve/{c}"]) for c in ("extend", "retract")]
    measured = {c: log[c] for c in ("piston/F", *PRESSURES) if c in log}
    sigma = {c: noise_of(c, y) for c, y in measured.items()}
    on = [(u > 0.5).astype(int).astype(str) for u in sent]
    seen = ~blind(log.time, np.isfinite(log["piston/x"]), np.stack(sent))
    keep = {c: np.isfinite(y) & seen for c, y in measured.items()}
    commands = (pulses(log.time, sent[0]), pulses(log.time, sent[1]))
    return BenchLog(name, motion, commands, measured, sigma, np.char.add(*on), keep)


def noise_of(channel: str, y: Array) -> float:
    """White noise per sample; a simulation without any is still no better than its own steps."""
    least = FINEST_FORCE if channel == "piston/F" else FINEST_PRESSURE
    spread = float(np.ptp(y[np.isfinite(y)]))
    return max(difference_sigma(y), least + 5e-4 * spread)


def blind(time: Array, good: Flags, sent: Array) -> Flags:
    """Rows (n,) in and just after gaps of the position, and of the time itself; when a valve has
    switched meanwhile, until the chambers have forgotten when."""
    known = np.flatnonzero(good)
    wide = np.flatnonzero(np.diff(time[known]) > GAP)
    hidden = np.zeros(len(time), dtype=bool)
    for begin, end in zip(known[wide], known[wide + 1], strict=True):
        switched = np.any(sent[:, begin] != sent[:, end])
        after = time[end] + (FORGET if switched else GAP)
        hidden |= (time > time[begin]) & (time < after)
    return hidden
