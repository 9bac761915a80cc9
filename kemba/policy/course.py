"""The course of an executed table: flows, controller ticks, valve edges and impacts in order."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np
from scipy.linalg import expm

from kemba.model import Model
from kemba.ocp.phases.modes import HELD, OPEN
from kemba.plant.commands import JointControl, Profile, among, delayed, merged
from kemba.plant.controller import PERIOD, condition_of, read_controller
from kemba.plant.record import Impact as Hit
from kemba.plant.simulate import simulate_one
from kemba.policy.modes import (
    BESIDE,
    CLOSING,
    FINER,
    PASSES,
    SAME,
    Array,
    Edge,
    Event,
    EventCourse,
    Flow,
    Hybrid,
    Point,
    Saltation,
    Tick,
)
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
        self.names = [q.name for q in model.state]
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
        modes = self.hybrid.modes(self.motion, i if modes_of is None else modes_of)
        return Point(self.x[i], u, modes)

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
        each = [self._in_order(before, after, order, labels) for order in orders]
        return np.asarray(np.mean(each, axis=0))

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


def course_of(model: Model, table: Trajectory) -> EventCourse:
    """The linearised execution of a controller table. Raises KembaError where the table cannot be
    simulated, ValueError for a model with other pairs than rigid contacts and stops."""
    table, hybrid = read_controller(table), Hybrid(model)
    condition = condition_of(table, model)
    begin, condition = condition.begin, replace(condition, begin=0.0)
    commands, last = condition.commands, condition.duration
    assert commands is not None and isinstance(commands.feedback, JointControl)
    acting = delayed(model, dict(commands.profiles))
    switched = np.concatenate([switches(p) for p in acting.values()])
    clock = np.arange(round((last - 1e-9) / PERIOD) + 1) * PERIOD
    done, finer = simulate_one(condition), np.zeros(0)
    for number in range(PASSES):  # marks near an impact move it by some microseconds
        hits = np.array([time[:2] for time in _clusters(done.impacts, last)]).reshape(-1, 2)
        begins, ends = hits[:, 0] - BESIDE, hits[:, 1] + BESIDE
        marks = merged(clock, switched[switched > 0.0], begins, ends, finer)
        marks = marks[~((marks[:, None] > begins) & (marks[:, None] < ends)).any(1)]
        done = simulate_one(replace(condition, sample=marks[marks < last - 1e-9]))
        if number == 0:
            finer = _changes(hybrid, done.trajectory)
    motion, impacts = done.trajectory, _clusters(done.impacts, last)
    builder = Builder(hybrid, motion, dict(commands.profiles), acting, commands.feedback, begin)
    events = tuple(builder.events(clock, impacts))
    rows = np.flatnonzero(among(motion.time, clock))
    shown = motion.rows(rows)
    shown = shown.at_times(shown.time + begin)
    return EventCourse(hybrid, table, shown, builder.x[rows], events, commands.feedback.joints)


def _changes(hybrid: Hybrid, motion: Trajectory) -> Array:
    """Times [s] within every step in which a contact changes, so that the change is found."""
    modes = [hybrid.modes(motion, i) for i in range(len(motion))]
    steps = [i for i in range(len(modes) - 1) if modes[i] != modes[i + 1]]
    inner = [np.linspace(motion.time[i], motion.time[i + 1], FINER + 1)[1:-1] for i in steps]
    return np.concatenate([np.zeros(0), *inner])


def _clusters(impacts: Sequence[Hit], last: float) -> list[tuple[float, float, set[str]]]:
    """Impacts that happen at once as one: from when to when [s], and at which pairs."""
    found = list[tuple[float, float, set[str]]]()
    for impact in (i for i in impacts if BESIDE < i.time < last - BESIDE):
        if found and impact.time - found[-1][1] < 4 * BESIDE:
            begin, _, labels = found.pop()
            found.append((begin, impact.time, labels | set(impact.labels)))
        else:
            found.append((impact.time, impact.time, set(impact.labels)))
    return found
