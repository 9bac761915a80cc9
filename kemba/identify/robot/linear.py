"""The motion along which a model is linearised, how it is first found, and the model linearised
along it: a filter's system, force defects, contact forces.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from kemba.identify.problem.problem import Array, Flags
from kemba.identify.robot.batch import Batch, travelled
from kemba.identify.robot.contact import (
    ContactSchedule,
    first_nodes,
    read_schedule,
    steady,
    steady_while,
)
from kemba.identify.robot.filter import FilterGains, Noise, System, coloured, gains, smooth
from kemba.identify.robot.physics import Physics


@dataclass(frozen=True)
class ForceDensity:
    """Density of the forces that no model explains: force on the `body` [N2.s], moment on it
    (`pitch`) and torque at a `hip` [N2.m2.s], force on a `rod` [N2.s]."""

    body: float = 5e-3
    pitch: float = 2e-4
    hip: float = 2e-4
    rod: float = 2e-2


LOOSE = ForceDensity(0.05, 2e-3, 2e-3, 0.5)  # while the motion is smoothed: it follows the data
QUIET = ForceDensity(1e-5, 1e-6, 1e-6, 1e-5)  # as good as none: all that is unknown is missing

# Density of forces that are unknown in contact.
CONTACT = 300.0  # of a foot on the ground, a piston at a stop [N2.s]
IMPACT = 3e4  # of an impact [N2.s]
SLIPPING = 1.0  # of a sliding foot, beyond its friction [N2.s]
STOPPED = 50.0  # of a rod, above which its force is a stop's [N2.s]
EDGE = 8  # nodes that an impact at a stop lasts
AIR = 100.0  # of a rod where a log does not begin at rest [N2.s]
AIR_FADES = 0.025  # time in which this fades [s]
REST = 5  # node of a log that tells whether it begins at rest

# Places that stand still: of feet on the ground, of pistons at their stops.
GROUND = 1e-4  # noise of a standing foot's place [m]
GROUND_LEVEL = 2.5e-4  # prior sigma of the ground's height [m]
GROUND_WANDER = 6e-5 / math.sqrt(0.02)  # wander of a standing foot [m.s-1/2]: 60 um in 20 ms
STOP = 1e-4  # noise of a piston at its stop [m]
STOP_WANDER = 1e-4 / math.sqrt(0.02)  # wander of a stop [m.s-1/2]: 0.1 mm in 20 ms
UNKNOWN = 3.0  # prior sigma of a place [m]: no knowledge
FREE = 1.0  # wander of a free foot's place [m.s-1/2]: no hold
POSITION = 0.03  # prior sigma of a deviation from the reference [m, rad]: no knowledge
VELOCITY = 3.0  # prior sigma of its rate [m.s-1, rad.s-1]: no knowledge
THINNEST = 0.5  # smallest factor by which a yielding ground stiffens: stays positive

# Smoothing of every coordinate for itself: density of its acceleration, of the body along the rail
# [m2.s-3], its height and its pitch [rad2.s-3], of a hip and a knee [rad2.s-3].
SMOOTHED = {"body/x": 30.0, "body/z": 60.0, "body/pitch": 300.0, "hip/q": 2e3, "knee/q": 2e5}
# prior sigma of a start [m, rad] and of its rate [m.s-1, rad.s-1]: no knowledge
ANYWHERE, ANYHOW = 10.0, 100.0


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
    """Every coordinate smoothed on its own; of the model only its lengths count, at `p` (k,)."""
    k, legs = physics.mechanism.n, len(physics.legs)
    y = batch.flat(batch.y)
    pistons = y[:, -legs:]
    knees = np.where(np.isfinite(pistons), physics.knees(np.nan_to_num(pistons), p), np.nan)
    q = np.hstack([y[:, :-legs], knees])
    known = np.nan_to_num(q)
    slope = np.diagonal(physics.call("measured", known, 0 * known, p=p)[2], axis1=1, axis2=2)
    q, slope = batch.deep(q, np.nan), batch.deep(np.abs(slope), 1.0)
    F, G = integrator(batch.h, k, 0)
    names = ["/".join(c.name.split("/")[-2:]) for c in physics.mechanism.coordinates]
    density = np.array([SMOOTHED[name] for name in names])
    W = np.eye(k) * density / batch.h[..., None, None]
    R = np.where(np.isfinite(q), (batch.sigma / slope) ** 2, np.inf)
    H = np.broadcast_to(np.hstack([np.eye(k), np.zeros((k, k))]), (*q.shape[:2], k, 2 * k))
    P0 = np.broadcast_to(np.diag([ANYWHERE] * k + [ANYHOW] * k), (q.shape[1], 2 * k, 2 * k))
    system = System(F, G, W, H, R, P0)
    x, w, _ = smooth(system, gains(system), q, np.zeros((*q.shape[:2], k)))
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
    legs, parts = len(physics.legs), []
    for log, schedule in zip(batch.resampled, schedules, strict=True):
        own = [least.body, least.body, least.pitch] + [least.hip] * legs + [least.rod] * legs
        density = np.tile(np.array(own + [0.0] * 2 * legs), (len(log.time), 1))
        rods = density[:, 3 + legs : 3 + 2 * legs]
        stopped = schedule.low | schedule.high
        rods += np.where(stopped, CONTACT, 0.0)
        rods += np.where(stopped & schedule.struck, IMPACT, 0.0)
        rods += np.where(first_nodes(stopped, EDGE), IMPACT, 0.0)
        if schedule.phase[min(REST, len(schedule.phase) - 1)] != "rest":
            since = (log.time - log.time[0])[:, None]
            rods += AIR * np.exp(-2.0 * since / AIR_FADES)
        feet = np.where(schedule.foot, CONTACT, 0.0)
        feet = feet + np.where(schedule.struck, IMPACT, 0.0)
        density[:, 3 + 2 * legs :] = np.repeat(feet, 2, axis=1)
        parts.append(density)
    return batch.pad(parts, 0.0)


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
        growth = np.maximum(1.0 + d * self.sinking, THINNEST)
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
    held = batch.pad([x.held.astype(float) for x in schedules], 0.0) > 0.5
    wander = np.array([GROUND_WANDER] * 2 * legs + [STOP_WANDER] * legs)
    free = np.array([FREE, GROUND_WANDER] * legs + [FREE] * legs)
    i = np.arange(places)
    W[..., k + i, k + i] = np.where(held, wander, free) ** 2 * batch.h[..., None]
    H = np.zeros((*batch.h.shape, k + places, 2 * k + places))
    H[..., :k, :k] = Jy
    H[..., k:, :k] = np.concatenate([Jf, Jy[..., k - legs :, :]], axis=2)
    H[..., k + i, 2 * k + i] = 1.0
    sharp = np.array([GROUND] * 2 * legs + [STOP] * legs)
    read = np.where(np.isfinite(batch.y), batch.sigma**2, np.inf)
    R = np.concatenate([read, np.where(held, sharp**2, np.inf)], axis=2)
    prior = [POSITION] * k + [VELOCITY] * k
    prior += [UNKNOWN, GROUND_LEVEL] * legs + [UNKNOWN] * legs
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
    x, w, _ = smooth(motion.system, gain, y, g)
    A_q, A_v = motion.A
    dq, dv = x[..., :k], x[..., k : 2 * k]
    turn = (A_q @ dq[..., None] + A_v @ dv[..., None])[..., 0]
    live = np.any(motion.inverse != 0.0, axis=(2, 3))[..., None]
    a = np.where(live, motion.ref.a + turn + g + w[..., :k], 0.0)
    return Reference(motion.ref.q + dq, motion.ref.v + dv, a)
