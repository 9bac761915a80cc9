"""The reference: the motion along which a model is linearised, and how it is first found."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kemba.identify.problem.problem import Array
from kemba.identify.robot.batch import Batch
from kemba.identify.robot.contact import ContactSchedule, first_nodes, read_schedule
from kemba.identify.robot.filter import System, gains, smooth
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


class PlaceSettings:
    """Places that stand still: of feet on the ground, of pistons at their stops."""

    ground = 1e-4  # noise of a standing foot's place [m]
    ground_level = 2.5e-4  # prior sigma of the ground's height [m]
    ground_wander = 6e-5 / math.sqrt(0.02)  # wander of a standing foot [m.s-1/2]: 60 um in 20 ms
    stop = 1e-4  # noise of a piston at its stop [m]
    stop_wander = 1e-4 / math.sqrt(0.02)  # wander of a stop [m.s-1/2]: 0.1 mm in 20 ms
    unknown = 3.0  # prior sigma of a place [m]: no knowledge
    free = 1.0  # wander of a free foot's place [m.s-1/2]: no hold
    position = 0.03  # prior sigma of a deviation from the reference [m, rad]: no knowledge
    velocity = 3.0  # prior sigma of its rate [m.s-1, rad.s-1]: no knowledge
    thinnest = 0.5  # smallest factor by which a yielding ground stiffens: stays positive


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
