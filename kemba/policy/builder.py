"""From the rows of a simulation to flows, ticks, edges and impacts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np
from scipy.linalg import expm

from kemba.ocp.phases.modes import HELD, OPEN
from kemba.plant.commands import JointControl, Profile, among
from kemba.plant.controller import PERIOD
from kemba.policy.events import Edge, Event, Flow, Saltation, Tick
from kemba.policy.modes import Array, Hybrid, Point
from kemba.policy.settings import CLOSING, SAME
from kemba.trajectory import Trajectory


def switches(profile: Profile) -> Array:
    """When [s] a valve that is closed at first opens, closes, opens ..."""
    changes = np.diff(np.round(profile.values), prepend=0.0) != 0.0
    return np.asarray(profile.times[changes])


class Builder:
    """The events between the rows of a simulation, whose clock begins at `begin` [s]."""

    def __init__(
        self,
        hybrid: Hybrid,
        motion: Trajectory,
        sent: Mapping[str, Profile],
        acting: Mapping[str, Profile],
        control: JointControl,
        begin: float,
    ) -> None:
        self.hybrid, self.motion, self.begin = hybrid, motion, begin
        self.sent, self.acting, self.control = sent, acting, control
        model = hybrid.model
        names = [q.name for q in (*model.mechanism.coordinates, *model.mechanism.velocities)]
        self.names = [*names, *(q.name for q in model.states.values())]
        self.inputs = [q.name for q in model.inputs.values()]
        self.x = np.column_stack([motion[name] for name in self.names])
        self.torques = [self.inputs.index(f"{joint}/tau") for joint in control.joints]

    def events(
        self, clock: np.ndarray, impacts: Sequence[tuple[float, float, set[str]]]
    ) -> Iterator[Event]:
        """All events in order of time, by the clock of the plan."""
        time, ticks = self.motion.time, among(self.motion.time, clock)
        hits = {int(np.searchsorted(time, t)) - 1: labels for t, _, labels in impacts}
        yield Saltation(float(time[0]) + self.begin, self._start())
        for i in range(len(time) - 1):
            now = float(time[i]) + self.begin
            yield from self._edges(i, now)
            if ticks[i]:
                yield Tick(now, round(now / PERIOD), self._hold(i))
            if i in hits:
                yield Saltation(now, self._saltation(i, hits[i]))
            yield Flow(now, float(time[i + 1]) + self.begin, self._flow(i, i in hits))

    def point(self, i: int, valves_at: float, modes_of: int | None = None) -> Point:
        """State, inputs and modes at row i, the valves as they act at a time [s]."""
        u = np.array([self.motion[name][i] for name in self.inputs])
        for name, profile in self.acting.items():
            u[self.inputs.index(name)] = profile(valves_at)
        return Point(
            self.x[i], u, self.hybrid.modes(self.motion, i if modes_of is None else modes_of)
        )

    def _start(self) -> Array:
        """What touches at the start stops at once: the slope of that."""
        first, n = self.point(0, 0.0), self.hybrid.n
        reset = np.eye(self.hybrid.size)
        reset[n : 2 * n, : 2 * n] = self.hybrid.jump(first.x, first.modes)[1]
        return reset

    def _flow(self, i: int, after: bool) -> Array:
        """The map of (x, torques) from row i to the next; `after`: in the mode of the latter."""
        n, m = self.hybrid.size, len(self.torques)
        middle = float(self.motion.time[i] + self.motion.time[i + 1]) / 2
        slope = np.zeros((n + m, n + m))
        here = self.point(i, middle, i + int(after))
        there = replace(here, x=self.x[i + 1])
        for at in (there, there) if after else (here, there):
            _, A, B = self.hybrid.flow(at)
            slope[:n, :n] += A / 2
            slope[:n, n:] += B[:, self.torques] / 2
        return np.asarray(expm(slope * (self.motion.time[i + 1] - self.motion.time[i])))

    def _hold(self, i: int) -> Array:
        """The slope of the hip torques by x (eq. 10); zero where a motor gives all it can."""
        hold = np.zeros((len(self.torques), self.hybrid.size))
        wanted = self.control.at(self.motion.time[i : i + 1])[0]
        for j, joint in enumerate(self.control.joints):
            q, w = (self.names.index(f"{joint}/{s}") for s in ("q", "w"))
            q_d, w_d, ahead = wanted[j]
            K_p, K_d, x = self.control.K_p, self.control.K_d, self.x[i]
            asked = K_p * (q_d - x[q]) + K_d * (w_d - x[w])
            if abs(asked + ahead - self.motion[f"{joint}/tau"][i]) < 1e-6:
                hold[j, [q, w]] = -K_p, -K_d
        return hold

    def _edges(self, i: int, now: float) -> Iterator[Edge]:
        """The valves that switch at row i."""
        time = float(self.motion.time[i])
        for name, profile in self.acting.items():
            acts, sent = switches(profile), switches(self.sent[name])
            at = np.flatnonzero(np.abs(acts - time) < SAME)
            if not len(at) or len(acts) != len(sent):  # pulses that merged cannot be told apart
                continue
            modes_of, k = max(i - 1, 0), int(at[0])
            after = self.point(i, time + 2 * SAME, modes_of)
            before = replace(after, u=after.u.copy())
            before.u[self.inputs.index(name)] = profile(time - 2 * SAME)
            late = self.hybrid.flow(before)[0] - self.hybrid.flow(after)[0]
            yield Edge(now, name, k, round((float(sent[k]) + self.begin) / PERIOD), late)

    def _saltation(self, i: int, labels: set[str]) -> Array:
        """The slope (n, n) of the state after an impact, between rows i and i + 1.

        Of several at once each order is taken, and the mean of all.
        """
        before, after = self.point(i, self.motion.time[i]), self.point(i + 1, self.motion.time[i])
        _, J = self.hybrid.gaps(before.x)
        n = self.hybrid.n
        rates = J @ before.x[n : 2 * n]
        new = [
            k for k, c in enumerate(self.hybrid.constraints)
            if c.label in labels and before.modes[k] == OPEN and rates[k] < -CLOSING
        ]  # fmt: skip
        orders = list(permutations(new)) if 1 < len(new) <= 3 else [tuple(new)]
        return np.asarray(
            np.mean([self._in_order(before, after, order, labels) for order in orders], axis=0)
        )

    def _in_order(
        self, before: Point, after: Point, order: Sequence[int], labels: set[str]
    ) -> Array:
        """The saltation of impacts one after the other, at one instant."""
        n, size = self.hybrid.n, self.hybrid.size
        found, here = np.eye(size), before
        for position, k in enumerate(order):
            _, J = self.hybrid.gaps(here.x)
            guard = np.r_[J[k], np.zeros(size - n)]
            modes = [
                m if a != OPEN or c.label in labels else OPEN  # what opens bears no impulse
                for m, a, c in zip(here.modes, after.modes, self.hybrid.constraints, strict=True)
            ]
            modes[k] = HELD
            modes = list(self.hybrid.landing(here.x, tuple(modes), k))
            v, slope = self.hybrid.jump(here.x, tuple(modes))
            reset = np.eye(size)
            reset[n : 2 * n, : 2 * n] = slope
            x = np.concatenate([here.x[:n], v, here.x[2 * n :]])
            last = position == len(order) - 1
            there = Point(x, here.u, after.modes if last else tuple(modes))
            rate = float(guard @ self.hybrid.flow(here)[0])
            if rate < -CLOSING:
                jump = self.hybrid.flow(there)[0] - reset @ self.hybrid.flow(here)[0]
                reset = reset + np.outer(jump, guard) / rate
            found, here = reset @ found, there
        return found
