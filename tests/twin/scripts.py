"""Command scripts: hip references, open-loop valves, and where it starts."""

import csv
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from .control import R_COUNT, R_FOLLOW, R_KD, R_KP, R_Q, R_QD, R_TAU
from .figures import HALF_BODY, STANCE_HIP, STANCE_Z, leg_fold
from .valves import VALVES

KP, KD = 150.0, 3.0
FRONT_E, FRONT_R, REAR_E, REAR_R = range(4)


@dataclass(frozen=True)
class Start:
    """Pose and rates (vx, vz, pitch', hip' x2, piston' x2) at time zero."""

    x: float = 0.0
    z: float = STANCE_Z
    pitch: float = 0.0
    hips: tuple[float, float] = (-STANCE_HIP, STANCE_HIP)
    pistons: tuple[float, float] = (0.0, 0.0)
    rates: tuple[float, ...] = (0.0,) * 7


@dataclass(frozen=True)
class Script:
    """One motion, sampled at the control ticks."""

    name: str
    ticks: np.ndarray
    refs: np.ndarray
    sent: np.ndarray
    start: Start = field(default_factory=Start)


def clock(duration: float, rate: float = 1000.0, jitter: float = 0.0, rng=None) -> np.ndarray:
    """Tick times; `jitter` (s) moves each inner tick, never past its neighbour."""
    ticks = np.arange(round(duration * rate) + 1) / rate
    if jitter > 0.0:
        ticks[1:-1] += np.clip(
            jitter * rng.standard_normal(ticks.size - 2), -0.4 / rate, 0.4 / rate
        )
    return ticks


def on_feet(pistons) -> Start:
    """Standing with each foot under its hip; unlike pistons pitch the body."""
    folds = [leg_fold(x) for x in pistons]
    pitch = float(np.arcsin((folds[0][0] - folds[1][0]) / (2.0 * HALF_BODY)))
    hips = (-folds[0][1] - pitch, folds[1][1] - pitch)
    z = 0.5 * (folds[0][0] + folds[1][0])
    return Start(z=z, pitch=pitch, hips=hips, pistons=tuple(pistons))


def in_air(z: float, pistons=(0.03, 0.03), pitch: float = 0.0, rates=(0.0,) * 7) -> Start:
    """Held in the air, then let go at time zero."""
    hips = (-leg_fold(pistons[0])[1], leg_fold(pistons[1])[1])
    return Start(z=z, pitch=pitch, hips=hips, pistons=tuple(pistons), rates=tuple(rates))


def script(name, ticks, pulses, start=None, offsets=None, follow=1.0, kp=KP, kd=KD, feed=None):
    """Build a script; `pulses`: (valve, on, off), `offsets`: (time, front, rear) hip knots."""
    refs = np.zeros((ticks.size, R_COUNT))
    refs[:, R_FOLLOW], refs[:, R_KP], refs[:, R_KD] = follow, kp, kd
    if offsets is not None:
        knots = np.asarray(offsets, dtype=float)
        for leg in range(2):
            refs[:, R_Q + leg] = np.interp(ticks, knots[:, 0], knots[:, 1 + leg])
            refs[:, R_QD + leg] = np.gradient(refs[:, R_Q + leg], ticks)
    if feed is not None:
        refs[:, R_TAU : R_TAU + 2] = feed
    sent = np.zeros((ticks.size, 4))
    for valve, on, off in pulses:
        sent[(ticks >= on - 1e-9) & (ticks < off - 1e-9), valve] = 1.0
    return Script(name, ticks, refs, sent, start or Start())


def with_start(motion: Script, **changes) -> Script:
    return replace(motion, start=replace(motion.start, **changes))


def short_hop(duration=0.4) -> Script:
    """A push, a flight and a landing, for tests."""
    pulses = [(FRONT_E, 0.0, 0.14), (REAR_E, 0.004, 0.147)]
    pulses += [(FRONT_R, 0.2, 0.3), (REAR_R, 0.2, 0.25), (FRONT_E, 0.25, 0.3)]
    knots = [(0.0, 0.0, 0.0), (0.15, -0.05, -0.08), (0.4, 0.1, 0.0)]
    return script("hop", clock(duration), pulses, offsets=knots)


def from_table(path: str | Path, name: str | None = None, kp=KP, kd=KD, start=None) -> Script:
    """A controller table: time, hip q, w (or qd) and tau, valves as sent; names of the log format.

    The run starts at rest in the pose of the first row, or at `start`.
    """
    with open(path, newline="") as handle:
        rows = list(csv.reader(handle))
    header, data = rows[0], np.array([[float(c or "nan") for c in r] for r in rows[1:]])
    column = {h.split(" [")[0].strip(): i for i, h in enumerate(header)}

    def pick(*names, default=None):
        for n in names:
            if n in column:
                return data[:, column[n]]
        if default is None:
            raise ValueError(f"{path}: no column {names[0]!r}; found {', '.join(column)}")
        return np.full(data.shape[0], default)

    ticks = pick("time")
    refs = np.zeros((ticks.size, R_COUNT))
    refs[:, R_KP], refs[:, R_KD] = kp, kd
    for leg, side in enumerate(("front", "rear")):
        q = pick(f"{side}/hip/q")
        refs[:, R_Q + leg] = q
        try:
            refs[:, R_QD + leg] = pick(f"{side}/hip/w", f"{side}/hip/qd", f"{side}/hip/v")
        except ValueError:
            refs[:, R_QD + leg] = np.gradient(q, ticks)
        refs[:, R_TAU + leg] = pick(f"{side}/hip/tau", default=0.0)
    sent = np.stack([pick(v) for v in VALVES], axis=1)
    if start is None:
        pistons = [float(pick(f"{s}/piston/x", default=0.0)[0]) for s in ("front", "rear")]
        start = Start(
            x=float(pick("body/x", default=0.0)[0]),
            z=float(pick("body/z", default=STANCE_Z)[0]),
            pitch=float(pick("body/pitch", default=0.0)[0]),
            hips=(float(refs[0, R_Q]), float(refs[0, R_Q + 1])),
            pistons=(pistons[0], pistons[1]),
        )
    return Script(name or Path(path).stem, ticks - ticks[0], refs, (sent > 0.5) * 1.0, start)
