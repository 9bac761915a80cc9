"""The reference: the motion along which a model is linearised, and how it is first found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kemba.identify.robot.dynamics.physics import Physics
from kemba.identify.robot.motion.batch import Batch
from kemba.identify.robot.motion.contact import Schedule, read_schedule
from kemba.identify.robot.motion.filter import System, gains, smooth

Array = np.ndarray[Any, np.dtype[np.float64]]

# Spectral densities (variance per Hz times s): force of body x, z [N2.s], then moments.
KINEMATIC = {"body/x": 30.0, "body/z": 60.0, "body/pitch": 300.0, "hip": 2e3, "knee": 2e5}
GROUND_SIGMA, GROUND_PRIOR, GROUND_WANDER = 1e-4, 2.5e-4, 6e-5 / np.sqrt(0.02)
STOP_SIGMA, STOP_WANDER = 1e-4, 1e-4 / np.sqrt(0.02)
ANCHOR_PRIOR, ANCHOR_FREE = 3.0, 1.0  # m, m.s-1/2: where along the ground a foot stands
CONTACT, IMPACT = 300.0, 3e4  # N2.s
SLIPPING = 1.0  # N2.s: friction of a sliding foot beyond Coulomb's
UNKNOWN_AIR, AIR_FADES = 100.0, 0.025  # N2.s at the start of a log that does not begin at rest


@dataclass(frozen=True)
class ForceDensity:
    """Spectral density of the forces that no model explains: on the body and the rods [N2.s], at
    pitch and hips [N2.m2.s]."""

    body: float = 5e-3
    pitch: float = 2e-4
    hip: float = 2e-4
    rod: float = 2e-2


LOOSE = ForceDensity(body=0.05, pitch=2e-3, hip=2e-3, rod=0.5)  # for smoothing: follow the data


@dataclass(frozen=True)
class Reference:
    """Motion: q, v (n, L, k) at the nodes, acceleration `a` (n, L, k) over each step."""

    q: Array
    v: Array
    a: Array

    def middle(self, h: Array) -> tuple[Array, Array, Array]:
        """q, v, a in the middle of every step."""
        h = h[..., None]
        return self.q + 0.5 * h * self.v + h**2 / 8 * self.a, self.v + 0.5 * h * self.a, self.a


def integrator(h: Array, k: int, extra: int) -> tuple[Array, Array]:
    """F (n, L, d, d), G (n, L, d, k + extra) of k double integrators and `extra` constants that may
    drift, over steps `h` (n, L) [s]; d = 2 k + extra."""
    n, runs = h.shape
    d = 2 * k + extra
    F = np.broadcast_to(np.eye(d), (n, runs, d, d)).copy()
    G = np.zeros((n, runs, d, k + extra))
    i, j = np.arange(k), np.arange(extra)
    F[..., i, k + i] = h[..., None]
    G[..., i, i] = h[..., None] ** 2 / 2
    G[..., k + i, i] = h[..., None]
    G[..., 2 * k + j, k + j] = 1.0
    return F, G


def first_reference(physics: Physics, batch: Batch) -> Reference:
    """Every coordinate smoothed on its own, without the model."""
    k, legs = physics.mechanism.n, len(physics.legs)
    y = batch.flat(batch.y)
    pistons = y[:, -legs:]
    knees = np.where(np.isfinite(pistons), physics.knees(np.nan_to_num(pistons)), np.nan)
    q = np.hstack([y[:, :-legs], knees])
    slope = np.diagonal(physics.call("measured", np.nan_to_num(q), 0 * q)[2], axis1=1, axis2=2)
    q, slope = batch.deep(q, np.nan), batch.deep(np.abs(slope), 1.0)
    F, G = integrator(batch.h, k, 0)
    names = [c.name for c in physics.mechanism.coordinates]
    density = np.array([_kinematic(name) for name in names])
    W = np.eye(k) * density / batch.h[..., None, None]
    R = np.where(np.isfinite(q), (batch.sigma / slope) ** 2, np.inf)
    H = np.broadcast_to(np.hstack([np.eye(k), np.zeros((k, k))]), (*q.shape[:2], k, 2 * k))
    P0 = np.broadcast_to(np.diag([10.0] * k + [100.0] * k), (q.shape[1], 2 * k, 2 * k))
    system = System(F, G, W, H, R, P0)
    x, w = smooth(system, gains(system), q, np.zeros((*q.shape[:2], k)))
    return Reference(x[..., :k], x[..., k:], np.where(batch.valid[..., None], w, 0.0))


def _kinematic(name: str) -> float:
    return KINEMATIC.get(name) or KINEMATIC["hip" if "hip" in name else "knee"]


def read_schedules(physics: Physics, batch: Batch, ref: Reference) -> tuple[Schedule, ...]:
    """Contact read from the motion of each run."""
    q, v = batch.flat(ref.q), batch.flat(ref.v)
    legs = len(physics.legs)
    feet = batch.deep(physics.call("feet", q, v)[0].reshape(-1, legs, 2))
    y = batch.deep(physics.call("measured", q, v)[0])
    found = []
    for i, log in enumerate(batch.resampled):
        n = len(log.time)
        found.append(
            read_schedule(
                log.time,
                feet[:n, i],
                y[:n, i, -legs:],
                physics.mechanism.stroke,
                ref.q[:n, i, :3],
            )
        )
    return tuple(found)


def densities(
    physics: Physics, batch: Batch, schedules: Sequence[Schedule], least: ForceDensity
) -> Array:
    """(n, L, k + 2 legs): density of unknown force per measured channel and foot axis.

    `least`: density everywhere; contacts, impacts and stops add to it.
    """
    legs, parts = len(physics.legs), []
    for log, schedule in zip(batch.resampled, schedules, strict=True):
        own = [least.body, least.body, least.pitch] + [least.hip] * legs + [least.rod] * legs
        density = np.tile(np.array(own + [0.0] * 2 * legs), (len(log.time), 1))
        rods = density[:, 3 + legs : 3 + 2 * legs]
        rods += np.where(schedule.low | schedule.high, CONTACT, 0.0)
        rods += np.where((schedule.low | schedule.high) & schedule.struck, IMPACT, 0.0)
        rods += _edges(schedule.low | schedule.high)
        if schedule.phase[min(5, len(schedule.phase) - 1)] != "rest":
            since = (log.time - log.time[0])[:, None]
            rods += UNKNOWN_AIR * np.exp(-2.0 * since / AIR_FADES)
        feet = np.where(schedule.foot, CONTACT, 0.0) + np.where(schedule.struck, IMPACT, 0.0)
        density[:, 3 + 2 * legs :] = np.repeat(feet, 2, axis=1)
        parts.append(density)
    return batch.pad(parts, 0.0)


def _edges(flags: np.ndarray[Any, Any]) -> Array:
    """Density (n, legs) in the eight nodes after a piston reaches a stop."""
    change = np.zeros(flags.shape, bool)
    change[1:] = flags[1:] & ~flags[:-1]
    wide = change.copy()
    for shift in range(1, 8):
        wide[shift:] |= change[:-shift]
    return np.where(wide, IMPACT, 0.0)
