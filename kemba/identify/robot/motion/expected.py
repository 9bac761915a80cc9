"""The residuals that a right model would leave: sensor noise alone, through the same filter."""

from __future__ import annotations

import numpy as np

from kemba.identify.problem.types import Array
from kemba.identify.robot.motion.colour import simulated
from kemba.identify.robot.motion.filter import FilterGains, System, innovations


class ExpectedSettings:
    """Expected power of the residuals, by simulation."""

    draws = 6  # simulated logs
    width = 21  # nodes over which the power is averaged; odd
    least = 0.02  # smallest power


def expected_power(system: System, gain: FilterGains, seed: int = 0) -> Array:
    """Mean square (n, L, m) of the whitened innovations that sensor noise alone makes.

    It is below 1 where the filter allows for contact forces that a steady stance does not need.
    The draws are few, so that their power is averaged over some nodes.
    """
    settings = ExpectedSettings
    rng = np.random.default_rng(seed)
    y = simulated(system, settings.draws, rng)
    power = np.mean(innovations(system, gain, y, None) ** 2, axis=-1)
    width = settings.width
    padded = np.pad(power, ((width // 2, width // 2), (0, 0), (0, 0)), mode="edge")
    total = np.cumsum(padded, axis=0)
    total = np.concatenate([np.zeros((1, *total.shape[1:])), total])
    return np.asarray(np.maximum((total[width:] - total[:-width]) / width, settings.least))


def predicted_error(system: System, y: Array, g: Array, steps: int) -> Array:
    """y (n, L, m) minus its prediction, begun anew on the reference every so many steps.

    In the channels' units: how far the model's motion leaves the measured one in a window; `g`
    (n, L, j): accelerations of the first j channels of G.
    """
    n, runs, m, d = system.H.shape
    push = (system.G[..., : g.shape[2]] @ g[..., None])[..., 0]
    errors = np.empty((n, runs, m))
    x = np.zeros((runs, d))
    for k in range(n):
        if k % steps == 0:
            x = np.zeros((runs, d))
        errors[k] = y[k] - (system.H[k] @ x[..., None])[..., 0]
        x = (system.F[k] @ x[..., None])[..., 0] + push[k]
    return errors
