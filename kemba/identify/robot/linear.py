"""The model linearised along a reference: a filter's system, force defects, contact forces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kemba.identify.robot.batch import Batch
from kemba.identify.robot.contact import Schedule
from kemba.identify.robot.filter import System, gains, smooth
from kemba.identify.robot.physics import Physics
from kemba.identify.robot.reference import (
    ANCHOR_FREE,
    ANCHOR_PRIOR,
    GROUND_PRIOR,
    GROUND_SIGMA,
    GROUND_WANDER,
    Reference,
    integrator,
)

Array = np.ndarray[Any, np.dtype[np.float64]]


@dataclass(frozen=True)
class Linearised:
    """Everything about one reference that does not change with theta."""

    ref: Reference
    middle: tuple[Array, Array, Array]  # flat q, v, a in the middle of each step
    states: tuple[Array, Array]
    system: System
    inverse: Array  # (n, L, k, k) of the mass matrix
    contact: Array  # (n, L, k) generalised contact and stop force found in the data
    normal: Array  # (n, L, legs) contact force, up
    y: Array
    rate: Array
    feet: Array  # (n, L, 2 legs), x and z of each
    sinking: Array
    masses: Array
    A: tuple[Array, Array]

    def force(self, physics: Physics, batch: Batch, states: tuple[Array, Array], p: Array) -> Array:
        """Force (n, L, k) that the motion needs beyond model and contact."""
        s, u = (batch.flat(a) for a in states)
        return batch.deep(physics.call("residual", *self.middle, s, u, p=p)[0]) - self.contact

    def defect(self, force: Array) -> Array:
        """Acceleration that the model adds to the reference's, (n, L, k)."""
        return -(self.inverse @ force[..., None])[..., 0]

    def extend(self, g: Array) -> Array:
        """`g` (n, L, k, c) with the feet's places, which nothing pushes."""
        return np.concatenate([g, np.zeros((*g.shape[:2], 2 * self.normal.shape[2], g.shape[3]))], 2)

    def penetration(self, softness: float, d: float) -> Array:
        """Depth (n, L, 2 legs) of the feet in a floor of stiffness 1/softness."""
        growth = np.maximum(1.0 + d * self.sinking, 0.05)
        depth = np.zeros_like(self.feet)
        depth[..., 1::2] = softness * np.maximum(self.normal, 0.0) / growth
        return depth


def linearise(
    physics: Physics,
    batch: Batch,
    plan: Sequence[Schedule],
    ref: Reference,
    density: Array,
    states: tuple[Array, Array],
    p: Array,
) -> Linearised:
    """The model along `ref` with unknown forces of `density` per channel and foot axis."""
    k, legs = physics.mechanism.n, len(physics.legs)
    mid = tuple(batch.flat(a) for a in ref.middle(batch.h))
    s, u = (batch.flat(a) for a in states)
    M, by_q, by_v = (batch.deep(a) for a in physics.call("linear", *mid, s, u, p=p))
    force = batch.deep(physics.call("residual", *mid, s, u, p=p)[0])
    at_nodes = [batch.flat(ref.q), batch.flat(ref.v)]
    y, rate, Jy = (batch.deep(a) for a in physics.call("measured", *at_nodes))
    feet, feet_rate, Jf = (batch.deep(a) for a in physics.call("feet", *at_nodes))
    inverse = np.linalg.inv(M)
    A_q, A_v = -inverse @ by_q, -inverse @ by_v
    channels = np.concatenate([Jy, Jf], axis=2).swapaxes(-1, -2)
    contact, feet_force = contact_force(channels, density, force, k, legs)

    h = batch.h[..., None, None]
    places = 2 * legs  # x and z of every foot's place on the ground
    F, G = integrator(batch.h, k, places)
    F[..., :k, :k] += h**2 / 2 * A_q
    F[..., :k, k : 2 * k] += h**2 / 2 * A_v
    F[..., k : 2 * k, :k] += h * A_q
    F[..., k : 2 * k, k : 2 * k] += h * A_v
    pushed = inverse @ channels
    W = np.zeros((*batch.h.shape, k + places, k + places))
    W[..., :k, :k] = (pushed * (density[..., None, :] / h)) @ pushed.swapaxes(-1, -2)
    settled = batch.pad([x.settled.astype(float) for x in plan], 0.0) > 0.5
    slides = batch.pad([x.slides for x in plan], 0.0) != 0.0
    held = np.stack([settled & ~slides, settled], axis=-1).reshape(*batch.h.shape, places)
    free = np.tile([ANCHOR_FREE, GROUND_WANDER], legs)
    i = np.arange(places)
    W[..., k + i, k + i] = np.where(held, GROUND_WANDER, free) ** 2 * batch.h[..., None]
    H = np.zeros((*batch.h.shape, k + places, 2 * k + places))
    H[..., :k, :k] = Jy
    H[..., k:, :k] = Jf
    H[..., k + i, 2 * k + i] = 1.0
    R = np.concatenate(
        [
            np.where(np.isfinite(batch.y), batch.sigma**2, np.inf),
            np.where(held, GROUND_SIGMA**2, np.inf),
        ],
        axis=2,
    )
    prior = [0.03] * k + [3.0] * k + [ANCHOR_PRIOR, GROUND_PRIOR] * legs
    P0 = np.diag(prior) ** 2
    system = System(F, G, W, H, R, np.broadcast_to(P0, (len(batch.tracks), *P0.shape)))
    ends = ~batch.valid
    ends[:-1] |= ~batch.valid[1:]
    system.W[ends], system.F[ends] = 0.0, np.eye(2 * k + places)
    inverse = np.where(ends[..., None, None], 0.0, inverse)
    masses = batch.deep(physics.call("masses", *mid)[0])
    return Linearised(
        ref, mid, states, system, inverse, contact, feet_force[..., 1::2], y, rate,
        feet, -feet_rate[..., 1::2], masses, (A_q, A_v),
    )


def contact_force(
    channels: Array, density: Array, force: Array, k: int, legs: int
) -> tuple[Array, Array]:
    """Generalised force (n, L, k) of contacts and stops in `force`, and the feet's (n, L, 2 legs).

    The split of least norm, weighted with what each channel is thought capable of.
    """
    weighted = channels * density[..., None, :]
    S = weighted @ channels.swapaxes(-1, -2)
    S = S + 1e-9 * np.eye(k)
    share = (weighted.swapaxes(-1, -2) @ np.linalg.solve(S, force[..., None]))[..., 0]
    feet = share[..., k:]
    stops = share[..., k - legs : k] * (density[..., k - legs : k] > 50.0)
    rigid = np.concatenate([stops, feet], axis=-1)
    acting = channels[..., k - legs :]
    return (acting @ rigid[..., None])[..., 0], feet


def smoothed(point: Linearised, y: Array, g: Array) -> Reference:
    """A better reference: the smoothed deviations added."""
    k = point.ref.q.shape[2]
    g_all = point.extend(g[..., None])[..., 0]
    x, w = smooth(point.system, gains(point.system), y, g_all)
    A_q, A_v = point.A
    dq, dv = x[..., :k], x[..., k : 2 * k]
    turn = (A_q @ dq[..., None] + A_v @ dv[..., None])[..., 0]
    live = np.any(point.inverse != 0.0, axis=(2, 3))[..., None]
    a = np.where(live, point.ref.a + turn + g + w[..., :k], 0.0)
    return Reference(point.ref.q + dq, point.ref.v + dv, a)
