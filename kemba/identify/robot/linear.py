"""The model linearised along a reference: a filter's system, force defects, contact forces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from kemba.identify.problem.problem import Array, Flags
from kemba.identify.robot.batch import Batch, travelled
from kemba.identify.robot.contact import ContactSchedule, steady, steady_while
from kemba.identify.robot.filter import FilterGains, System, smooth
from kemba.identify.robot.noise import Noise, coloured
from kemba.identify.robot.physics import Physics
from kemba.identify.robot.reference import (
    SLIPPING,
    STOPPED,
    PlaceSettings,
    Reference,
    integrator,
)


@dataclass(frozen=True)
class LinearisedMotion:
    """A model linearised along one reference: everything that does not change with theta.

    n nodes, L runs, k coordinates, m measured channels. Rates are per second; forces are
    generalised: N for a distance, N.m for an angle.
    """

    ref: Reference
    middle: tuple[Array, Array, Array]  # (N, k) each: q, v, a in the middle of each step
    states: tuple[Array, Array]  # (n, L, .): effect states and inputs, mean over each step
    system: System  # with the noise of the sensors as it is coloured
    plain: System  # the same with white noise
    inverse: Array  # (n, L, k, k) of the mass matrix
    contact: Array  # (n, L, k) generalised contact and stop force found in the data, steady
    normal: Array  # (n, L, legs) contact force, up, steady
    y: Array  # (n, L, m) measured coordinates along the reference
    rate: Array  # (n, L, m) their rates
    way: Array  # (n, L, m) of the measured coordinates since the start
    places: Array  # (n, L, 3 legs): x and z of each foot, pistons
    sinking: Array  # (n, L, legs) speed of the feet, down, steady
    links: Array  # (n, L, k, figures) force per share by which a link's mass or inertia is off
    less_grip: Array  # (n, L, k) force that is missing per unit of friction coefficient
    shift: Array  # (n, L, k) acceleration that the model adds to the reference's; 0 at ends
    A: tuple[Array, Array]  # (n, L, k, k) each: slopes of the acceleration along q and v
    channels: Array  # (n, L, k, c) generalised force per unknown force: channels, then feet

    def response(self, force: Array) -> Array:
        """Acceleration (n, L, k) that a missing force (n, L, k) would have made."""
        return -(self.inverse @ force[..., None])[..., 0]

    def defect(self, force: Array) -> Array:
        """Acceleration (n, L, k) that the model adds to the reference's, with a force (n, L, k)
        that the motion needs beyond model and contact."""
        return self.shift + self.response(force)

    def with_noise(self, noise: Noise, batch: Batch) -> LinearisedMotion:
        """The same motion, read by sensors with this noise."""
        return replace(self, system=coloured(self.plain, noise, batch.sigma, batch.h))

    def penetration(self, softness: float, d: float) -> Array:
        """Depth (n, L, 3 legs) [m] of the feet in a ground of stiffness 1/softness [N.m-1] and
        damping `d` [s.m-1]."""
        growth = np.maximum(1.0 + d * self.sinking, PlaceSettings.thinnest)
        legs = self.normal.shape[2]
        depth = np.zeros_like(self.places)
        depth[..., 1 : 2 * legs : 2] = softness * np.maximum(self.normal, 0.0) / growth
        return depth


def linearise_along(
    physics: Physics,
    batch: Batch,
    schedules: Sequence[ContactSchedule],
    ref: Reference,
    density: Array,
    states: tuple[Array, Array],
    p: Array,
    noise: Noise = (),
) -> LinearisedMotion:
    """The model along `ref`, with unknown forces of `density` (n, L, c) per channel and foot axis.

    `states`: effect states and inputs (n, L, .); `p` (parameters,) in the order of `physics.names`;
    `noise` of the sensors.
    """
    k, legs = physics.mechanism.n, len(physics.legs)
    mid = tuple(batch.flat(a) for a in ref.middle(batch.h))
    s, u = (batch.flat(a) for a in states)
    inverse = batch.deep(np.asarray(np.linalg.inv(physics.call("mass", *mid, s, u, p=p)[0])))
    force = batch.deep(physics.call("residual", *mid, s, u, p=p)[0])
    at_nodes = [batch.flat(ref.q), batch.flat(ref.v)]
    y, rate, Jy = (batch.deep(a) for a in physics.call("measured", *at_nodes, p=p))
    feet, feet_rate, Jf = (batch.deep(a) for a in physics.call("feet", *at_nodes, p=p))
    slip = batch.pad([x.slides for x in schedules], 0.0)
    density = density.copy()
    for leg in range(legs):  # a sliding foot pushes along the edge of its cone
        pushing = k + 2 * leg
        density[..., pushing] = np.where(slip[..., leg] != 0.0, SLIPPING, density[..., pushing])
    Jf_force = Jf.copy()
    grip = physics.mechanism.scene.ground.friction(feet[..., 0::2], physics.grip)
    Jf_force[..., 1::2, :] -= (grip * slip)[..., None] * Jf[..., 0::2, :]
    channels = np.concatenate([Jy, Jf_force], axis=2).swapaxes(-1, -2)
    rigid, acts = _rigid_forces(channels, density, force, k, legs)
    dt = float(np.median(batch.h[batch.valid]))
    normal = steady(rigid[..., legs + 1 :: 2], dt)
    acting = channels[..., k - legs :]
    raw = (acting @ np.where(acts, rigid, 0.0)[..., None])[..., 0]
    shift = -(inverse @ (force - raw)[..., None])[..., 0]
    # Inertia is judged at the model's acceleration. The data's own is mostly noise, and noise in a
    # regressor makes the mass look smaller. The same noise is in the forces of contacts and stops,
    # which are read from the data: from row to row they are smoothed.
    contact = (acting @ steady_while(rigid, acts, dt)[..., None])[..., 0]
    calm = mid[2] - batch.flat((inverse @ (force - contact)[..., None])[..., 0])
    mid = (mid[0], mid[1], calm)
    A_q, A_v = (-inverse @ batch.deep(a) for a in physics.call("stiffness", *mid, s, u, p=p))
    pressed = slip * np.maximum(normal, 0.0)
    less_grip = (pressed[..., None] * Jf[..., 0::2, :]).sum(axis=2)
    unknown, ends = scatter(inverse @ channels, density, batch.h), _run_ends(batch)[..., None]
    system = _filter_system(batch, schedules, (Jy, Jf), (A_q, A_v), unknown)
    return LinearisedMotion(
        ref,
        mid,
        states,
        coloured(system, noise, batch.sigma, batch.h),
        system,
        np.where(ends[..., None], 0.0, inverse),
        contact,
        normal,
        y,
        rate,
        travelled(rate, batch.h),
        np.concatenate([feet, y[..., k - legs :]], axis=2),
        steady(-feet_rate[..., 1::2], dt),
        batch.deep(physics.call("links", *mid)[0]),
        less_grip,
        np.where(ends, 0.0, shift),
        (A_q, A_v),
        channels,
    )


def _filter_system(
    batch: Batch,
    schedules: Sequence[ContactSchedule],
    measured: tuple[Array, Array],
    slopes: tuple[Array, Array],
    unknown: Array,
) -> System:
    """States: deviations of q, v (n, L, 2 k), then places where feet and stops stand."""
    (Jy, Jf), (A_q, A_v) = measured, slopes
    k, legs = Jy.shape[-1], Jf.shape[2] // 2
    places = 3 * legs  # x and z of each foot, and the stop on which each piston rests
    h = batch.h[..., None, None]
    F, G = integrator(batch.h, k, places)
    F[..., :k, :k] += h**2 / 2 * A_q
    F[..., :k, k : 2 * k] += h**2 / 2 * A_v
    F[..., k : 2 * k, :k] += h * A_q
    F[..., k : 2 * k, k : 2 * k] += h * A_v
    W = np.zeros((*batch.h.shape, k + places, k + places))
    W[..., :k, :k] = unknown
    still = PlaceSettings
    held = batch.pad([x.held.astype(float) for x in schedules], 0.0) > 0.5
    wander = np.array([still.ground_wander] * 2 * legs + [still.stop_wander] * legs)
    free = np.array([still.free, still.ground_wander] * legs + [still.free] * legs)
    i = np.arange(places)
    W[..., k + i, k + i] = np.where(held, wander, free) ** 2 * batch.h[..., None]
    H = np.zeros((*batch.h.shape, k + places, 2 * k + places))
    H[..., :k, :k] = Jy
    H[..., k:, :k] = np.concatenate([Jf, Jy[..., k - legs :, :]], axis=2)
    H[..., k + i, 2 * k + i] = 1.0
    sharp = np.array([still.ground] * 2 * legs + [still.stop] * legs)
    read = np.where(np.isfinite(batch.y), batch.sigma**2, np.inf)
    R = np.concatenate([read, np.where(held, sharp**2, np.inf)], axis=2)
    prior = [still.position] * k + [still.velocity] * k
    prior += [still.unknown, still.ground_level] * legs + [still.unknown] * legs
    P0 = np.diag(prior) ** 2
    ends = _run_ends(batch)
    W[ends], F[ends] = 0.0, np.eye(2 * k + places)
    return System(F, G, W, H, R, np.broadcast_to(P0, (len(batch.resampled), *P0.shape)))


def _run_ends(batch: Batch) -> Flags:
    """Steps (n, L) that do not lead to another node of their run."""
    ends = ~batch.valid
    ends[:-1] |= ~batch.valid[1:]
    return ends


def scatter(pushed: Array, density: Array, h: Array) -> Array:
    """Covariance (n, L, k, k) of the acceleration over a step that unknown forces make.

    `pushed` (n, L, k, c): acceleration per unknown force; `density` (n, L, c): of these forces;
    `h` (n, L) [s].
    """
    return np.asarray((pushed * (density / h[..., None])[..., None, :]) @ pushed.swapaxes(-1, -2))


def _rigid_forces(
    channels: Array, density: Array, force: Array, k: int, legs: int
) -> tuple[Array, Flags]:
    """Forces (n, L, 3 legs) [N] of stops, then feet, of least norm, and where they act."""
    weighted = channels * density[..., None, :]
    S = weighted @ channels.swapaxes(-1, -2)
    S = S + 1e-9 * np.eye(k)
    share = (weighted.swapaxes(-1, -2) @ np.linalg.solve(S, force[..., None]))[..., 0]
    # along the ground a sliding foot has its friction: what is beyond that is an error to be seen
    least = np.array([STOPPED] * legs + [SLIPPING, 0.0] * legs)
    return share[..., k - legs :], density[..., k - legs :] > least


def smoothed(motion: LinearisedMotion, gain: FilterGains, y: Array, g: Array) -> Reference:
    """A better reference: the smoothed deviations added. `y` (n, L, m) measured beyond the
    reference, `g` (n, L, k) acceleration of the model beyond the reference's."""
    k = motion.ref.q.shape[2]
    x, w = smooth(motion.system, gain, y, g)
    A_q, A_v = motion.A
    dq, dv = x[..., :k], x[..., k : 2 * k]
    turn = (A_q @ dq[..., None] + A_v @ dv[..., None])[..., 0]
    live = np.any(motion.inverse != 0.0, axis=(2, 3))[..., None]
    a = np.where(live, motion.ref.a + turn + g + w[..., :k], 0.0)
    return Reference(motion.ref.q + dq, motion.ref.v + dv, a)
