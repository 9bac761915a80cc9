"""The reference: the motion along which a model is linearised, and how it is first found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kemba.identify.problem.types import Array
from kemba.identify.robot.dynamics.physics import Physics
from kemba.identify.robot.dynamics.settings import (
    ContactForceSettings,
    ForceDensity,
    KinematicSettings,
)
from kemba.identify.robot.motion.batch import Batch
from kemba.identify.robot.motion.contact import ContactSchedule, read_schedule
from kemba.identify.robot.motion.filter import System, gains, smooth


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


def first_reference(physics: Physics, batch: Batch, p: Array) -> Reference:
    """Every coordinate smoothed on its own; of the model only its lengths count, at `p`."""
    k, legs = physics.mechanism.n, len(physics.legs)
    y = batch.flat(batch.y)
    pistons = y[:, -legs:]
    knees = np.where(np.isfinite(pistons), physics.knees(np.nan_to_num(pistons), p), np.nan)
    q = np.hstack([y[:, :-legs], knees])
    known = np.nan_to_num(q)
    slope = np.diagonal(physics.call("measured", known, 0 * known, p=p)[2], axis1=1, axis2=2)
    q, slope = batch.deep(q, np.nan), batch.deep(np.abs(slope), 1.0)
    F, G = integrator(batch.h, k, 0)
    settings = KinematicSettings
    names = [c.name for c in physics.mechanism.coordinates]
    density = np.array([settings.density(name) for name in names])
    W = np.eye(k) * density / batch.h[..., None, None]
    R = np.where(np.isfinite(q), (batch.sigma / slope) ** 2, np.inf)
    H = np.broadcast_to(np.hstack([np.eye(k), np.zeros((k, k))]), (*q.shape[:2], k, 2 * k))
    P0 = np.broadcast_to(
        np.diag([settings.position] * k + [settings.velocity] * k), (q.shape[1], 2 * k, 2 * k)
    )
    system = System(F, G, W, H, R, P0)
    x, w = smooth(system, gains(system), q, np.zeros((*q.shape[:2], k)))
    return Reference(x[..., :k], x[..., k:], np.where(batch.valid[..., None], w, 0.0))


def read_schedules(
    physics: Physics, batch: Batch, ref: Reference, p: Array
) -> tuple[ContactSchedule, ...]:
    """Contact read from the motion of each run; `p` (k,) gives the lengths of the legs."""
    q, v = batch.flat(ref.q), batch.flat(ref.v)
    legs = len(physics.legs)
    feet = batch.deep(physics.call("feet", q, v, p=p)[0].reshape(-1, legs, 2))
    y = batch.deep(physics.call("measured", q, v, p=p)[0])
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
                batch.sigma[i, -legs:],
            )
        )
    return tuple(found)


def densities(
    physics: Physics, batch: Batch, schedules: Sequence[ContactSchedule], least: ForceDensity
) -> Array:
    """(n, L, k + 2 legs): density of unknown force per measured channel and foot axis.

    `least`: density everywhere; contacts, impacts and stops add to it.
    """
    legs, parts, unknown = len(physics.legs), [], ContactForceSettings
    for log, schedule in zip(batch.resampled, schedules, strict=True):
        own = [least.body, least.body, least.pitch] + [least.hip] * legs + [least.rod] * legs
        density = np.tile(np.array(own + [0.0] * 2 * legs), (len(log.time), 1))
        rods = density[:, 3 + legs : 3 + 2 * legs]
        rods += np.where(schedule.low | schedule.high, unknown.contact, 0.0)
        rods += np.where((schedule.low | schedule.high) & schedule.struck, unknown.impact, 0.0)
        rods += _edges(schedule.low | schedule.high)
        if schedule.phase[min(unknown.rest, len(schedule.phase) - 1)] != "rest":
            since = (log.time - log.time[0])[:, None]
            rods += unknown.air * np.exp(-2.0 * since / unknown.air_fades)
        feet = np.where(schedule.foot, unknown.contact, 0.0)
        feet = feet + np.where(schedule.struck, unknown.impact, 0.0)
        density[:, 3 + 2 * legs :] = np.repeat(feet, 2, axis=1)
        parts.append(density)
    return batch.pad(parts, 0.0)


def _edges(flags: np.ndarray[Any, Any]) -> Array:
    """Density (n, legs) in the nodes after a piston reaches a stop."""
    unknown = ContactForceSettings
    change = np.zeros(flags.shape, bool)
    change[1:] = flags[1:] & ~flags[:-1]
    wide = change.copy()
    for shift in range(1, unknown.edge):
        wide[shift:] |= change[:-shift]
    return np.where(wide, unknown.impact, 0.0)
