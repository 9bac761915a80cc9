"""How much force a robot model lacks: d(t) per physical channel with its 95 % band.

Every channel's unknown force is a first-order lag of white noise, and a state of the filter. Its
strength is learnt from the data; a channel that needs no force ends with almost none. In stance
the contact forces are unknown too, so only the force that they cannot explain is found.
"""

from __future__ import annotations

import numpy as np

from kemba.identify.compare.missing_force import spans
from kemba.identify.problem.problem import Array, MissingForce, Theta
from kemba.identify.robot.dynamics.reference import densities
from kemba.identify.robot.dynamics.settings import QUIET
from kemba.identify.robot.motion.filter import System, gains, smooth_with_band
from kemba.identify.robot.state import LinearisedState


class RobotMissingSettings:
    """The missing force of robot logs. Its strength (1 sigma) is learnt per channel."""

    memory = 0.025  # correlation time of the missing force [s]
    rounds = 4  # rounds in which its strength is learnt
    body = 5.0  # strength with which learning begins [N]
    pitch = 0.5  # the same of the moment on the body [N.m]
    hip = 0.5  # the same of the torque at a hip [N.m]
    piston = 10.0  # the same of the force on a rod [N]
    negligible = 0.1  # strength of a force that is as good as none [N]
    negligible_moment = 0.01  # the same of a moment [N.m]


def robot_missing(
    state: LinearisedState, theta: Theta, strength: Array | None = None
) -> list[MissingForce]:
    """d(t) per run: force on the body [N], moments at pitch and hips [N.m], force on the rods [N].

    `strength` (k,): 1 sigma of each channel's force; learnt when not given.
    """
    names = state.physics.channels
    kinds = [_kind(name) for name in names]
    settings = RobotMissingSettings
    begin = np.array([getattr(settings, kind) for kind in kinds])
    sigma = begin if strength is None else strength
    moment = np.isin(kinds, ("pitch", "hip"))
    least = np.where(moment, settings.negligible_moment, settings.negligible)
    quiet = densities(state.physics, state.batch, state.schedules, QUIET)
    y, g = state.measurement(theta), state.acceleration(theta)
    valid, k = state.batch.valid, len(names)
    for _ in range(settings.rounds if strength is None else 1):
        system = with_forces(state, quiet, sigma)
        x, variance = smooth_with_band(system, gains(system), y, g)
        power = (x[..., -k:] ** 2 + variance[..., -k:])[valid].mean(axis=0)
        ratio = np.sqrt(power) / sigma
        # towards nothing such rounds creep, so that their steps are doubled
        used, sigma = sigma, np.maximum(sigma * np.where(ratio < 1.0, ratio**2, ratio), least)
    units = tuple("N.m" if kind in ("pitch", "hip") else "N" for kind in kinds)
    found = []
    for i, log in enumerate(state.batch.resampled):
        n = len(log.time)
        force, spread = x[:n, i, -k:], np.sqrt(variance[:n, i, -k:])
        down = spans(log.time, state.schedules[i].phase != "flight")
        found.append(MissingForce(log.name, log.time, names, units, force, spread, used, down))
    return found


def _kind(channel: str) -> str:
    last = channel.split("/")[1] if channel.count("/") > 1 else channel
    return {"body/pitch": "pitch", "hip": "hip", "piston": "piston"}.get(last, "body")


def with_forces(state: LinearisedState, density: Array, sigma: Array) -> System:
    """The filter's system with a lagged force per channel, 1 sigma `sigma` (k,), as more states.

    `density` (n, L, c): of the other unknown forces.
    """
    base = state.motion.system_with(density, state.batch.h)
    h, k = state.batch.h, len(sigma)
    n, runs, m, d = base.H.shape
    pushes = state.motion.channels[..., :k]  # generalised force per channel force
    F = np.zeros((n, runs, d + k, d + k))
    F[..., :d, :d] = base.F
    accelerations = base.G[..., : pushes.shape[2]] @ state.motion.inverse @ pushes
    F[..., :d, d:] = accelerations
    keep = np.exp(-h / RobotMissingSettings.memory)
    i = np.arange(k)
    F[..., d + i, d + i] = np.where(state.batch.valid, keep, 1.0)[..., None]
    j = base.G.shape[3]
    G = np.zeros((n, runs, d + k, j + k))
    G[..., :d, :j] = base.G
    G[..., d + i, j + i] = 1.0
    W = np.zeros((n, runs, j + k, j + k))
    W[..., :j, :j] = base.W
    W[..., j + i, j + i] = (1.0 - keep**2)[..., None] * sigma**2
    H = np.zeros((n, runs, m, d + k))
    H[..., :d] = base.H
    P0 = np.zeros((runs, d + k, d + k))
    P0[:, :d, :d] = base.P0
    P0[:, d + i, d + i] = sigma**2
    return System(F, G, W, H, base.R, P0)
