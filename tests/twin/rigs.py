"""What the rig is made to do: imposed strokes and sent valves."""

from dataclasses import dataclass

import numpy as np

from .figures import STROKE
from .scripts import clock


@dataclass(frozen=True)
class Rig:
    """One bench test: imposed motion and sent valves at the ticks."""

    name: str
    ticks: np.ndarray
    x: np.ndarray
    v: np.ndarray
    sent: np.ndarray  # (n, 2) extend, retract


def _sent(ticks, pulses):
    sent = np.zeros((ticks.size, 2))
    for valve, on, off in pulses:
        sent[(ticks >= on) & (ticks < off), valve] = 1.0
    return sent


def locked(ticks, x: float, rng, dwell: float = 0.25) -> Rig:
    """Rod held still, each valve switched on and off, then both."""
    order = rng.permutation([0, 1, 2])
    pulses, t = [], 0.05
    for what in np.tile(order, 8):
        on = dwell * rng.uniform(0.7, 1.3)
        valves_on = (0, 1) if what == 2 else (what,)
        pulses += [(valve, t, t + on) for valve in valves_on]
        t += on + dwell * rng.uniform(0.7, 1.3)
    still = np.full(ticks.size, x)
    return Rig("locked", ticks, still, np.zeros(ticks.size), _sent(ticks, pulses))


def slow_stroke(ticks, rng, speed: float = 0.02) -> Rig:
    """Slow triangle over most of the stroke in each of the valve modes."""
    low, high = 0.003, STROKE - 0.003
    phase = np.cumsum(np.concatenate([[0.0], np.diff(ticks)])) * speed / (high - low)
    phase += rng.uniform(0.0, 2.0)
    # rounded triangle: finite acceleration at the ends
    x = low + (high - low) * (0.5 - np.arcsin(0.995 * np.cos(np.pi * phase)) / np.pi)
    mode, pulses, t = rng.permutation(4), [], 0.0
    hold = ticks[-1] / 4.0
    for m in mode:
        if m & 1:
            pulses.append((0, t, t + hold))
        if m & 2:
            pulses.append((1, t, t + hold))
        t += hold
    return Rig("slow_stroke", ticks, x, np.gradient(x, ticks), _sent(ticks, pulses))


def random_motion(ticks, rng, rate: float = 10.0, fastest: float = 0.8) -> Rig:
    """The paper's check: Bernoulli valves at 10 Hz, random positions and speeds."""
    knots = np.arange(0.0, ticks[-1] + 2.0 / rate, 1.0 / rate)
    level = rng.uniform(0.002, STROKE - 0.002, knots.size)
    reach = fastest / rate / 1.9  # the blend's steepest slope is 1.9 times its mean
    for i in range(1, level.size):
        level[i] = np.clip(level[i], level[i - 1] - reach, level[i - 1] + reach)
    i = np.minimum((ticks * rate).astype(int), knots.size - 2)
    s = ticks * rate - i
    blend = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    slope = 30.0 * s**2 * (1.0 - s) ** 2 * rate
    x = level[i] + (level[i + 1] - level[i]) * blend
    v = (level[i + 1] - level[i]) * slope
    sent = (rng.random((knots.size, 2)) < 0.5).astype(float)[i]
    return Rig("random", ticks, x, v, sent)


def opposed(ticks, rng, speeds=(0.1, 0.25, 0.4, 0.55)) -> Rig:
    """Constant-speed strokes against a second piston, one valve mode and speed after another."""
    x, v = np.empty(ticks.size), np.empty(ticks.size)
    sent = np.zeros((ticks.size, 2))
    cases = [(m, s) for s in speeds for m in range(4)]
    cases = [cases[i] for i in rng.permutation(len(cases))]
    t, where, direction, n = 0.0, 0.004, 1.0, 0
    ramp = 0.02
    x[:], v[:] = where, 0.0
    while t < ticks[-1]:
        mode, speed = cases[n % len(cases)]
        n += 1
        travel = STROKE - 0.008
        moving = travel / speed + ramp
        settle = 0.15
        rows = (ticks >= t) & (ticks < t + settle + moving + 0.05)
        sent[rows, 0], sent[rows, 1] = mode & 1, (mode >> 1) & 1
        s = np.clip(ticks[rows] - t - settle, 0.0, moving)
        up, down = np.minimum(s, ramp), np.clip(s - (moving - ramp), 0.0, ramp)
        x[rows] = where + direction * speed * (s - up + 0.5 * up**2 / ramp - 0.5 * down**2 / ramp)
        v[rows] = direction * speed * (up - down) / ramp * (s < moving)
        where += direction * travel
        direction = -direction
        t += settle + moving + 0.05
    return Rig("opposed", ticks, x, v, sent)


def standard(name: str, duration: float, rate: float, jitter: float, rng) -> Rig:
    """One of the standard rig tests: locked, slow, random, opposed."""
    ticks = clock(duration, rate, jitter, rng)
    if name == "locked":
        return locked(ticks, rng.uniform(0.0, STROKE), rng)
    if name == "slow":
        return slow_stroke(ticks, rng, rng.uniform(0.03, 0.1))
    return {"random": random_motion, "opposed": opposed}[name](ticks, rng)
