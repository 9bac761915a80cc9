"""Coloured noise of sensors in the filter: each channel has white noise, and lags as more states.

A first-order lag of white noise is AR(1) noise: an exponential memory. The sum of white noise and
two lags also describes quantised channels and slow drift. It keeps its meaning where rows are
missing or nodes are not evenly spaced, which an AR model of rows does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kemba.identify.problem.sensor_noise import ChannelNoise
from kemba.identify.problem.types import Array
from kemba.identify.robot.motion.filter import System

Noise = Sequence[ChannelNoise]  # one per channel; empty: all are white


def is_white(noise: Noise) -> bool:
    """Whether no channel has a lag, nor another sigma than the stated one."""
    return all(channel == ChannelNoise() for channel in noise)


def coloured(system: System, noise: Noise, sigma: Array, h: Array) -> System:
    """The filter's system with every lag of `noise` as one more state.

    `system`: white, with the channels as its first rows; `sigma` (L, m): stated noise of each run's
    channels; `h` (n, L) [s]: length of each step.
    """
    if is_white(noise):
        return system
    lags = [(i, s, memory) for i, c in enumerate(noise) for s, memory in c.lags]
    n, runs, m, d = system.H.shape
    more, j = len(lags), system.G.shape[-1]
    channel = np.array([i for i, _, _ in lags], dtype=int)
    size = sigma[:, channel] * np.array([s for _, s, _ in lags])  # (L, lags)
    keep = np.exp(-h[..., None] / np.array([memory for _, _, memory in lags]))
    at = np.arange(more)
    F, G = np.zeros((n, runs, d + more, d + more)), np.zeros((n, runs, d + more, j + more))
    W, H = np.zeros((n, runs, j + more, j + more)), np.zeros((n, runs, m, d + more))
    P0 = np.zeros((runs, d + more, d + more))
    F[..., :d, :d], G[..., :d, :j], W[..., :j, :j] = system.F, system.G, system.W
    H[..., :d], P0[:, :d, :d] = system.H, system.P0
    F[..., d + at, d + at], G[..., d + at, j + at] = keep, 1.0
    W[..., j + at, j + at] = (1.0 - keep**2) * size**2
    H[..., channel, d + at] = 1.0
    P0[:, d + at, d + at] = size**2
    R = system.R.copy()
    R[..., : len(noise)] *= np.array([c.white for c in noise]) ** 2
    return replace(system, F=F, G=G, W=W, H=H, R=R, P0=P0, lags=more)


def simulated(system: System, draws: int, rng: np.random.Generator) -> Array:
    """Sensor noise (n, L, m, draws) as `system` describes it: white noise and lags."""
    sigma = np.sqrt(np.where(np.isfinite(system.R), system.R, 0.0))
    y = sigma[..., None] * rng.standard_normal((*sigma.shape, draws))
    if not system.lags:
        return np.asarray(y)
    own = slice(-system.lags, None)
    start = np.sqrt(np.diagonal(system.P0[:, own, own], axis1=1, axis2=2))
    drive = np.sqrt(np.diagonal(system.W[..., own, own], axis1=2, axis2=3))
    keep = np.diagonal(system.F[..., own, own], axis1=2, axis2=3)
    x = start[..., None] * rng.standard_normal((*start.shape, draws))
    for k in range(len(y)):
        y[k] += system.H[k][..., own] @ x
        x = keep[k][..., None] * x + drive[k][..., None] * rng.standard_normal(x.shape)
    return np.asarray(y)
