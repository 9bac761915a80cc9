"""Accelerations, impacts and their slopes in each contact mode of a model."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from kemba.model import Model
from kemba.ocp.phases.modes import AHEAD, BACK, HELD, OPEN
from kemba.ocp.transcription.symmetry import whole
from kemba.ocp.transcription.unilateral import Constraint, read_constraints
from kemba.trajectory import Trajectory

Array = np.ndarray[Any, np.dtype[np.float64]]
Modes = tuple[int, ...]


FORCE = 1e-3  # N; a smaller one is none: far below the weight, far above rounding
SLIP = 1e-3  # m/s; a slower foot sticks: the simulation holds one within 1e-9 m/s


@dataclass(frozen=True)
class Point:
    """A state x = (q, v, s) (n,) with inputs u (m,) and the mode of every constraint."""

    x: Array
    u: Array
    modes: Modes


class Hybrid:
    """A model's motion within a mode, and its jumps between modes, as functions of x = (q, v, s).

    Raises ValueError for a model with pairs other than rigid contacts and stops.
    """

    def __init__(self, model: Model) -> None:
        self.model, node = model, model.node
        self.constraints: list[Constraint] = read_constraints(model, whole(node))
        self.n, self.ns = node.q.numel(), node.s.numel()
        self.size = 2 * self.n + self.ns
        x = ca.vertcat(node.q, node.v, node.s)
        a, lam = node.a, node.lam
        zero = ca.SX.zeros(self.ns)
        speed = -ca.substitute(node.rate, node.sd, zero)
        rows = [node.dynamics]
        for c in self.constraints:
            rows += [_second(node, c.rate, a), lam[c.force]]
            if c.friction is not None:
                f = c.friction
                rows += [_second(node, f.slip, a), lam[f.forward]]
                rows += [f.cone_forward, f.cone_backward]
        used = [i for c in self.constraints for i in _forces(c)]
        self.used, z = used, ca.vertcat(a, *(lam[i] for i in used))
        r = ca.vertcat(*rows)
        free = [i for i in range(lam.numel()) if i not in used]
        r = ca.substitute(r, ca.vertcat(*(lam[i] for i in free)), ca.SX.zeros(len(free)))
        at = ca.SX.zeros(z.numel())
        self._rows = ca.Function(
            "rows", [x, node.u, z],
            [ca.substitute(r, z, at), ca.jacobian(r, z), ca.jacobian(r, x), ca.jacobian(r, node.u)],
        )  # fmt: skip
        self._air = ca.Function(
            "air", [x, node.u, z],
            [speed, ca.jacobian(speed, x), ca.jacobian(speed, z), ca.jacobian(speed, node.u)],
        )  # fmt: skip
        gaps = ca.vertcat(*(c.gap for c in self.constraints))
        mass = ca.jacobian(node.dynamics, a)
        slips = [c.friction.slip if c.friction else ca.SX(0) for c in self.constraints]
        J = ca.jacobian(gaps, node.q)
        T = ca.jacobian(ca.vertcat(*slips), node.v)
        self._gaps = ca.Function("gaps", [node.q], [gaps, J])
        after = ca.SX.sym("after", self.n)
        push = ca.SX.sym("push", 2 * len(self.constraints))
        force = ca.jtimes(node.dynamics, lam, _spread(lam, self.constraints, push))  # linear in lam
        hit = mass @ (after - node.v) + force
        both = ca.vertcat(after, push)
        spread = _spread(lam, self.constraints, push)
        frictions = [c.friction for c in self.constraints]
        cones = [
            ca.vertcat(f.cone_forward, f.cone_backward) if f else ca.SX.zeros(2) for f in frictions
        ]
        by_push = ca.jacobian(ca.substitute(ca.vertcat(*cones), lam, spread), push)
        self._cones = np.array(ca.Function("cones", [push], [by_push])(0))
        self._hit = ca.Function(
            "hit", [node.q, both, node.v],
            [hit, ca.jacobian(hit, both), ca.jacobian(hit, node.q), J, T,
             ca.jacobian(J @ after, node.q), ca.jacobian(T @ after, node.q)],
        )  # fmt: skip

    def modes(self, row: Trajectory, i: int) -> Modes:
        """The modes in row `i` of a simulation."""
        found = []
        names = [quantity.name for quantity in self.model.forces.values()]
        for c in self.constraints:
            if row[names[c.force]][i] <= FORCE:
                found.append(OPEN)
                continue
            foot = c.label.rsplit("/", 1)[0]
            slip = float(row[f"{foot}/foot/vx"][i]) if c.friction is not None else 0.0
            sliding = AHEAD if slip > 0 else BACK
            found.append(sliding if abs(slip) > SLIP else HELD)
        return tuple(found)

    def flow(self, at: Point) -> tuple[Array, Array, Array]:
        """dx/dt (size,) and its slopes by x (size, size) and u (size, m) in the point's mode."""
        n = self.n
        empty = np.zeros(n + len(self.used))
        g, K, R, U = (np.array(part) for part in self._rows(at.x, at.u, empty))
        keep = self._kept(at.modes)
        K, g, R, U = K[keep], g[keep, 0], R[keep], U[keep]
        z = -np.linalg.solve(K, g)
        _, _, R, U = (np.array(part) for part in self._rows(at.x, at.u, z))
        zx, zu = -np.linalg.solve(K, R[keep]), -np.linalg.solve(K, U[keep])
        sd, sx, sz, su = (np.array(part) for part in self._air(at.x, at.u, z))
        rate = np.concatenate([at.x[n : 2 * n], z[:n], sd.ravel()])
        A, B = np.zeros((self.size, self.size)), np.zeros((self.size, len(at.u)))
        A[:n, n : 2 * n] = np.eye(n)
        A[n : 2 * n], B[n : 2 * n] = zx[:n], zu[:n]
        A[2 * n :], B[2 * n :] = sx + sz @ zx, su + sz @ zu
        return rate, A, B

    def _kept(self, modes: Modes) -> list[int]:
        """The rows that hold in a mode."""
        keep, first = list(range(self.n)), self.n
        for c, mode in zip(self.constraints, modes, strict=True):
            keep.append(first + int(mode == OPEN))
            first += 2
            if c.friction is not None:
                keep.append(first + {HELD: 0, OPEN: 1, BACK: 2, AHEAD: 3}[mode])
                first += 4
        return keep

    def landing(self, x: Array, modes: Modes, hit: int) -> Modes:
        """The modes of an impact of constraint `hit`: feet whose friction does not hold them slide,
        and others that would be pulled open."""
        for _ in range(2 * len(modes)):
            push = self._impact(x, modes)[1]
            changed = list(modes)
            for i, (c, mode) in enumerate(zip(self.constraints, modes, strict=True)):
                forward, backward = self._cones[2 * i : 2 * i + 2] @ push
                if mode == HELD and c.friction is not None and min(forward, backward) < 0.0:
                    changed[i] = BACK if forward < backward else AHEAD
                elif mode != OPEN and push[2 * i] < 0.0 and i != hit:
                    changed[i] = OPEN
            if tuple(changed) == modes:
                break
            modes = tuple(changed)
        return modes

    def jump(self, x: Array, modes: Modes) -> tuple[Array, Array]:
        """The velocities (n,) after an inelastic impact into `modes`, and d(v+)/d(q, v)."""
        v, _, slope = self._impact(x, modes)
        return v, slope

    def _impact(self, x: Array, modes: Modes) -> tuple[Array, Array, Array]:
        """Velocities (n,) after an impact, impulses (2 c,), and d(v+)/d(q, v)."""
        n, count = self.n, len(self.constraints)
        q, v = x[:n], x[n : 2 * n]
        both = np.zeros(n + 2 * count)
        for _ in range(
            2
        ):  # affine in the unknowns: the first pass solves, the second differentiates
            hit, K, Q, J, T, Jq, Tq = (np.array(m) for m in self._hit(q, both, v))
            rows, slope, right = [K], [np.hstack([Q, K[:, :n] * -1.0])], [hit.ravel()]
            for i, (c, mode) in enumerate(zip(self.constraints, modes, strict=True)):
                for part, D, Dq, on in ((0, J, Jq, mode != OPEN), (1, T, Tq, mode == HELD)):
                    line, by = np.zeros(n + 2 * count), np.zeros(2 * n)
                    if on and (part == 0 or c.friction is not None):
                        line[:n], by[:n] = D[i], Dq[i]
                    elif part and mode in (AHEAD, BACK):  # the impulse is on the edge of the cone
                        line[n:] = self._cones[2 * i + int(mode == AHEAD)]
                    else:
                        line[n + 2 * i + part] = 1.0
                    rows.append(line[None])
                    slope.append(by[None])
                    right.append(np.array([line @ both]))
            whole_K = np.vstack(rows)
            both = both - np.linalg.solve(whole_K, np.concatenate(right))
        by_state = -np.linalg.solve(whole_K, np.vstack(slope))[:n]
        return both[:n], both[n:], np.asarray(by_state, dtype=float)

    def gaps(self, x: Array) -> tuple[Array, Array]:
        """Gaps (c,) and their slopes by q (c, n)."""
        g, J = self._gaps(x[: self.n])
        return np.array(g).ravel(), np.array(J)


def _second(node: Any, rate: ca.SX, a: ca.SX) -> ca.SX:
    """The time derivative of a rate that depends on q and v."""
    return ca.jtimes(rate, node.q, node.v) + ca.jtimes(rate, node.v, a)


def _forces(c: Constraint) -> Sequence[int]:
    return (c.force,) if c.friction is None else (c.force, c.friction.forward)


def _spread(lam: ca.SX, constraints: Sequence[Constraint], push: ca.SX) -> ca.SX:
    """Impulses (2 c,), normal and forward of every constraint, at their places in lam."""
    found = ca.SX.zeros(lam.numel())
    for i, c in enumerate(constraints):
        found[c.force] += push[2 * i]
        if c.friction is not None:
            found[c.friction.forward] += push[2 * i + 1]
    return found


@dataclass(frozen=True)
class Flow:
    """A stretch of time in one mode: its begin and end [s], its map of (x, torques)."""

    time: float
    end: float
    map: Array  # (n + m, n + m)


@dataclass(frozen=True)
class Tick:
    """The controller acts: torques = hold (m, n) x + what a policy adds. `tick`: its row."""

    time: float
    tick: int
    hold: Array


@dataclass(frozen=True)
class Edge:
    """A valve switches: `late` (n,) is the change of x per second by which it comes later.

    `valve`: its column; `index`: which of its edges; `sent`: the tick at which it is sent.
    """

    time: float
    valve: str
    index: int
    sent: int
    late: Array


@dataclass(frozen=True)
class Saltation:
    """A touchdown or a stop: the saltation matrix (n, n)."""

    time: float
    saltation: Array


Event = Flow | Tick | Edge | Saltation


@dataclass(frozen=True)
class EventCourse:
    """An executed table and its events in order; `motion` has a row at every tick."""

    hybrid: Hybrid
    table: Trajectory
    motion: Trajectory
    states: Array  # (ticks, n)
    events: tuple[Event, ...]
    joints: tuple[str, ...]


def plain(event: Event, n: int, m: int) -> Array:
    """The map of (x, torques) through an event without a policy."""
    whole = np.eye(n + m)
    if isinstance(event, Flow):
        return event.map
    if isinstance(event, Tick):
        whole[n:, :n], whole[n:, n:] = event.hold, 0.0
    elif isinstance(event, Saltation):
        whole[:n, :n] = event.saltation
    return whole


# chosen by hand, no comparison kept
LATEST = 8  # ms, by which an edge moves at most
ADDED = 5.0  # N.m, torque that is added at most


# deviations and corrections that cost the same: of the body's place [m], velocity [m/s], pitch
# [rad] and its rate [rad/s], of a hip or knee [rad] and its rate [rad/s]. A rate of pitch counts as
# what it turns in 0.3 s of flight, a joint as where it brings the foot (docs/policy.md)
PLACE, SPEED, PITCH, PITCH_RATE, JOINT, JOINT_RATE = 0.01, 0.1, 0.01, 0.03, 0.01, 2.0
# the same: torque that is added [N.m], time by which a valve edge moves [s]
TORQUE, EDGE = 2.0, 3e-3
FADING = 0.1  # s; stage costs of this long count as much as those at the end
# ticks before and after touchdown in which no torque is added: feet that touch a little sooner or
# later have quite other velocities
BLIND = 10
FINE = 4  # instants a tick at which valves of the simulated robot may act

# how the events along an executed table are found
CLOSING = 1e-6  # m/s; a gap that closes more slowly touches without an impact
SAME = 1e-8  # s; switches nearer than this are one
BESIDE = 2e-5  # s; states are read this far from an impact: other samples move it by up to 10 us
FINER = 20  # rows within a step in which a foot leaves the ground or begins to slide
PASSES = 3  # simulations in which the samples beside impacts find their place
