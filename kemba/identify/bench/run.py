"""One bench log, prepared for prediction."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from kemba.effects.friction import V_COULOMB
from kemba.identify.bench.motion import Motion, difference_sigma, smooth_motion
from kemba.identify.bench.plant import Pulses
from kemba.identify.bench.switching import pulses
from kemba.identify.problem import Array
from kemba.trajectory import Trajectory

PRESSURES = ("chamber/extend/P", "chamber/retract/P")
DAMPING, FRICTION = 60.0, 10.0  # N.s.m-1, N: usual figures of a cylinder of this size


@dataclass(frozen=True)
class Run:
    """One bench log, prepared: motion, commands, and the measured channels."""

    name: str
    motion: Motion
    commands: Pulses
    measured: dict[str, Array]
    sigma: dict[str, float]
    mode: np.ndarray
    keep: dict[str, np.ndarray] = field(default_factory=dict)

    @cached_property
    def blunt(self) -> Array:
        """Force error (n,) [N] that the error of the velocity makes: damping, and a friction of
        usual size where the direction of motion is in doubt. Alike for every hypothesis."""
        v = self.motion.v
        slope = DAMPING + FRICTION / V_COULOMB / np.cosh(np.clip(v / V_COULOMB, -30, 30)) ** 2
        return np.asarray(slope * self.motion.v_sigma)


def prepare(name: str, log: Trajectory) -> Run:
    """Smooth the motion and learn each channel's white noise from its fastest differences."""
    v = log["piston/v"] if "piston/v" in log else None
    motion = smooth_motion(log.time, log["piston/x"], v)
    extend, retract = (pulses(log.time, log[f"valve/{c}"]) for c in ("extend", "retract"))
    channels = ["piston/F", *(p for p in PRESSURES if p in log)]
    measured = {c: log[c] for c in channels}
    floor = {"piston/F": 0.05, **dict.fromkeys(PRESSURES, 50.0)}
    sigma = {c: max(difference_sigma(y), floor[c]) for c, y in measured.items()}
    on = [log[f"valve/{c}"] > 0.5 for c in ("extend", "retract")]
    mode = np.char.add(on[0].astype(int).astype(str), on[1].astype(int).astype(str))
    keep = {c: np.isfinite(y) for c, y in measured.items()}
    return Run(name, motion, (extend, retract), measured, sigma, mode, keep)
