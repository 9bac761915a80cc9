"""Robot logs with a model linearised along the measured motion: everything a prediction needs.

The measured motion is smoothed into a reference along which the model is linearised. A model that
is right explains the way from node to node; what it gets wrong is a force defect, which a Kalman
filter turns into innovations, white and of unit variance where model and noise are right. Initial
states are free; contact and stop forces are unknown where the data show contact, impacts included.
Effect states along the motion, and the forces that they make, are found with exact switching.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from kemba.effects.pneumatics.switching import cut, delayed, instants, is_on
from kemba.identify.problem.candidates import GRIP, SOFTNESS
from kemba.identify.problem.noise import ChannelNoise
from kemba.identify.problem.problem import Array, Flags, Theta
from kemba.identify.problem.sensor_faults import SensorFaults, is_fault
from kemba.identify.robot.batch import Batch, ResampledLog, ahead, sensed, whole_rows
from kemba.identify.robot.contact import ContactSchedule, loaded
from kemba.identify.robot.filter import (
    FilterGains,
    Noise,
    at_once,
    gains,
    innovations,
    noise_behind,
)
from kemba.identify.robot.linear import (
    LOOSE,
    ForceDensity,
    LinearisedMotion,
    Reference,
    densities,
    first_reference,
    linearise_along,
    read_schedules,
    smoothed,
)
from kemba.identify.robot.physics import Physics
from kemba.model.rest import Index


def substeps(log: ResampledLog, delays: Array) -> tuple[Array, Array, Index]:
    """(times (N + 1,), valves (valves, N), index of each node) with a time at every switching;
    `delays` (valves, 2): seconds from the command to switching on and off."""
    acting = [delayed(sent, *late) for sent, late in zip(log.sent, delays, strict=True)]
    times, index = cut(log.time, np.concatenate([instants(pulses) for pulses in acting]))
    middle = 0.5 * (times[1:] + times[:-1])
    return times, np.stack([is_on(pulses, middle) for pulses in acting]), index


def air_states(
    physics: Physics,
    batch: Batch,
    ref: Reference,
    delays: Array,
    p: Array,
    among: Index | None = None,
) -> tuple[Array, Array]:
    """Effect states (n, L, ns) and inputs (n, L, nu), both the mean over each step; `delays`
    (valves, 2) in seconds to switching on and off; `among`: states that are asked for (None:
    all)."""
    found: tuple[list[Array], list[Array]] = [], []
    for i, log in enumerate(batch.resampled):
        n = len(log.time)
        times, valves, index = substeps(log, delays)  # the run cut at every switching
        h = np.diff(times)
        middle = 0.5 * (times[1:] + times[:-1])
        q, v = (_at(log.time, a[:n, i], middle) for a in (ref.q, ref.v))
        held = np.clip(np.searchsorted(log.time, middle, side="right") - 1, 0, n - 1)
        u = physics.arrange(log.torque[held].T, valves).T
        width = np.append(np.diff(log.time), 1.0)[:, None]
        own = p[physics.moves]
        start = physics.states.rest(q[0], 0.0 * v[0], u[0], own)
        given = np.hstack([h[:, None], q, v, u])
        _, states = physics.states.run(start, given, own, among)
        for store, values in zip(found, (states, u), strict=True):
            padded = np.append(values * h[:, None], 0 * values[:1], axis=0)
            sums = np.add.reduceat(padded, index, axis=0)
            store.append(np.vstack([(sums / width)[:-1], values[-1:]]))
    return batch.pad(found[0], 0.0), batch.pad(found[1], 0.0)


def _at(time: Array, values: Array, times: Array) -> Array:
    """Linear interpolation of (n, k) at times: (m, k)."""
    right = np.clip(np.searchsorted(time, times), 1, len(time) - 1)
    share = ((times - time[right - 1]) / (time[right] - time[right - 1]))[:, None]
    return np.asarray(values[right - 1] + share * (values[right] - values[right - 1]))


KEPT = 4  # states that are kept beside the first ones
ROUNDS = 2  # times that the motion is smoothed with the model
LEAD_IN = 4  # nodes at the start that only tell where a run begins


@dataclass(frozen=True)
class LinearisedState:
    """Robot logs and a model linearised at `base`.

    Arrays have n nodes, L runs, k coordinates and m measured values per node: one per channel, then
    the places of feet and stops.

    `sensors`: what sensors make of the motion. `schedules`: contacts of each run. `motion`: the
    reference, and the model linearised along it. `gain`: gains of the filter. `mask` (n, L, m):
    rows that are data. `linear`: name -> generalised force (n, L, k) per unit of a parameter that
    stands beside the model, and its nominal value. `ground`: parameters of the model's soft ground,
    empty where it is rigid. `noise` of the sensors, as it is coloured; empty: white.
    """

    physics: Physics
    batch: Batch
    sensors: SensorFaults
    base: Theta
    ground: Mapping[str, float]
    schedules: tuple[ContactSchedule, ...]
    motion: LinearisedMotion
    gain: FilterGains
    mask: Flags
    noise: Noise = ()
    linear: Mapping[str, tuple[Array, float]] = field(default_factory=dict)
    _states: dict[bytes, tuple[Array, Array]] = field(default_factory=dict, repr=False)

    def measurement(self, theta: Theta) -> Array:
        """Measured minus reference (n, L, m) in the channel's unit, the reference as the sensors at
        theta see it; NaN where nothing was measured."""
        motion, batch = self.motion, self.batch
        faults = {c: self.sensors.at(theta, c) for c in self.physics.channels}
        y, places = self.seen(theta)
        seen = sensed(faults, batch.resampled, y, motion.way)
        soft = {**self.ground, **theta}
        depth = motion.penetration(soft.get(SOFTNESS, 0.0), soft.get("ground_compliance.d", 1.0))
        return np.concatenate([batch.y - seen, -places - depth], axis=2)

    def seen(self, theta: Theta) -> tuple[Array, Array]:
        """Channels (n, L, k), and places (n, L, 3 legs) of feet and pistons, along the reference,
        of a robot with the lengths at theta."""
        p, at, own = self.physics.at(theta), self.physics.at(self.base), self.physics.lengths
        if np.array_equal(p[own], at[own]):
            return self.motion.y, self.motion.places
        nodes = (self.batch.flat(a) for a in (self.motion.ref.q, self.motion.ref.v))
        y, feet = (self.batch.deep(a) for a in self.physics.call("seen", *nodes, p=p))
        stops = y[..., y.shape[2] - len(self.physics.legs) :]
        return y, np.concatenate([feet, stops], axis=2)

    def acceleration(self, theta: Theta) -> Array:
        """Acceleration (n, L, k) that the model at theta adds to the reference's."""
        p, delays = self.physics.at(theta), self.physics.timing(theta)
        states = self.states(p, delays, self.physics.states_at(p))
        samples = self.physics.call("residual", *self.motion.middle, *states, p=p)[0]
        force = self.batch.deep(samples) - self.motion.contact
        beside = [theta.get(name, nominal) - nominal for name, (_, nominal) in self.linear.items()]
        return self.motion.defect(force + self._columns @ beside if any(beside) else force)

    def states(self, p: Array, delays: Array, among: Index | None) -> tuple[Array, Array]:
        """Effect states (N, ns) and inputs (N, nu) at the samples, at parameters p (k,) and delays
        (valves, 2) [s]; `among`: states that are asked for (None: all)."""
        wanted = b"" if among is None else among.tobytes()
        key = delays.tobytes() + p[self.physics.moves].tobytes() + wanted
        if key not in self._states:
            if len(self._states) > KEPT:
                del self._states[list(self._states)[1]]
            found = air_states(self.physics, self.batch, self.motion.ref, delays, p, among)
            self._states[key] = self.batch.flat(found[0]), self.batch.flat(found[1])
        return self._states[key]

    @cached_property
    def _columns(self) -> Array:
        """Forces (n, L, k, c) per unit of the parameters that stand beside the model."""
        return np.stack([column for column, _ in self.linear.values()], axis=-1)

    def slopes(self, theta: Theta, names: Sequence[str]) -> Iterator[Array]:
        """Whitened column (rows,) of each parameter in turn, in which the force is linear."""
        if not names:
            return
        physics, p = self.physics, self.physics.at(theta)
        given = (*self.motion.middle, *self.states(p, physics.timing(theta), None))
        slopes = physics.call("by_parameter", *given, p=p)[0]
        place = {n: i for i, n in enumerate(physics.names)}
        for part in at_once(len(names)):
            forces = (
                self.linear[n][0] if n in self.linear else self.batch.deep(slopes[:, :, place[n]])
                for n in names[part]
            )
            g = np.stack([self.motion.response(f) for f in forces], axis=-1)
            yield from self.pick(self.pushed(g)).T

    def pushed(self, g: Array) -> Array:
        """Whitened residuals (n, L, m, c) that accelerations g (n, L, k, c) make."""
        return self.whitened(None, g)

    def whitened(self, y: Array | None, g: Array) -> Array:
        """Predicted minus measured (n, L, m, c), whitened, of columns y (n, L, m, c), None for
        zero, and accelerations g (n, L, k, c)."""
        return -innovations(self.motion.system, self.gain, y, g)

    def residuals(self, thetas: Sequence[Theta]) -> Array:
        """Whitened residuals (n, L, m, c) at each theta, rows that are no data included."""
        y = np.stack([self.measurement(t) for t in thetas], axis=-1)
        g = np.stack([self.acceleration(t) for t in thetas], axis=-1)
        return self.whitened(y, g)

    def each_residual(self, thetas: Sequence[Theta]) -> Iterator[Array]:
        """Whitened residuals (rows,) at each theta in turn."""
        for part in at_once(len(thetas)):
            yield from self.pick(self.residuals(thetas[part])).T

    def commanded(self, batch: Batch) -> Array:
        """Whitened residual (rows,) at the base if the commands had been those of `batch`."""
        found = replace(self, batch=batch, _states={}).residuals([self.base])
        return self.pick(found)[:, 0]

    def with_noise(self, noise: Noise) -> LinearisedState:
        """The same logs and motion, filtered with this noise of the sensors."""
        if tuple(noise) == tuple(self.noise):
            return self
        motion = self.motion.with_noise(noise, self.batch)
        return replace(self, motion=motion, gain=gains(motion.system), noise=tuple(noise))

    def spread(self, rows: Array) -> Array:
        """Rows (rows,) as `pick` gives them of all runs -> (n, L, m), NaN where there is no row."""
        whole = np.full(self.mask.shape, np.nan).swapaxes(0, 1)  # (L, n, m)
        done = 0
        for i in range(len(self.batch.resampled)):
            own = self.mask[:, i].T
            part = np.full(own.shape, np.nan)
            part[own] = rows[done : done + int(own.sum())]
            whole[i], done = part.T, done + int(own.sum())
        return np.asarray(whole.swapaxes(0, 1))

    def pick(self, columns: Array) -> Array:
        """(n, L, m, ...) -> rows (rows, ...): run by run, channel by channel, in time."""
        runs = range(len(self.batch.resampled))
        return np.concatenate([columns[:, i].swapaxes(0, 1)[self.mask[:, i].T] for i in runs])


def linearise_at(
    physics: Physics,
    batch: Batch,
    sensors: SensorFaults,
    base: Theta,
    ground: Mapping[str, float],
    unknown: ForceDensity,
    noise: Noise = (),
    first: Reference | None = None,
) -> LinearisedState:
    """The logs smoothed with the model at `base`, and the model linearised along that motion.

    `unknown`: density of the forces that no model explains; `noise` of the sensors; `first`: the
    motion smoothed without the model's forces, where it is known.
    """
    p = physics.at(base)
    dt = float(np.median(batch.h[batch.valid]))
    late = np.array([sensors.lateness(base, channel) for channel in physics.channels])
    rows = whole_rows(late, dt)
    batch = batch.moved(rows)
    if first is None or rows.any():
        first = first_reference(physics, batch, p)
    rates = ((first.q, first.v), (first.v, first.a), (first.a, np.zeros_like(first.a)))
    on_time = (ahead(a, rate, batch.resampled, late - rows * dt) for a, rate in rates)
    reference = Reference(*on_time)  # as sensors that are not late would have seen it
    schedules = read_schedules(physics, batch, reference, p)

    def along(unknown: ForceDensity) -> LinearisedState:
        """The model at `base` linearised along the reference as it is now."""
        delays = physics.timing(base)
        states = air_states(physics, batch, reference, delays, p)
        density = densities(physics, batch, schedules, unknown)
        motion = linearise_along(physics, batch, schedules, reference, density, states, p, noise)
        mask = np.isfinite(motion.system.R)
        mask[:LEAD_IN] = False
        made = (schedules, motion, gains(motion.system), mask, noise)
        return LinearisedState(physics, batch, sensors, dict(base), ground, *made)

    for _ in range(ROUNDS):
        state = along(LOOSE)
        y, g = state.measurement(base), state.acceleration(base)
        reference = smoothed(state.motion, state.gain, y, g)
        if sensors.present or any(map(is_fault, base)):  # as true sensors would have seen it
            schedules = read_schedules(physics, batch, reference, p)
        normal = [state.motion.normal[: len(s.phase), i] for i, s in enumerate(schedules)]
        schedules = tuple(loaded(s, f, dt) for s, f in zip(schedules, normal, strict=True))
        del state  # its arrays make room for the next one's
    state = along(unknown)
    links = zip(physics.links, np.moveaxis(state.motion.links, -1, 0), strict=True)
    linear = {name: (column, 0.0) for name, column in links}
    return replace(state, linear={**linear, GRIP: (state.motion.less_grip, 1.0)})


def learnt_from(state: LinearisedState, left: Array, drifts: bool) -> tuple[ChannelNoise, ...]:
    """The noise of each channel, learnt from the rows `left` (rows,) that a flexible model leaves;
    `drifts`: slow drifts are looked for, too."""
    motion, k = state.motion, state.motion.ref.q.shape[2]
    pushes = np.moveaxis(motion.inverse @ motion.channels[..., :k], -1, 0)
    errors = state.spread(left)
    return noise_behind(motion.system, state.gain, errors, state.batch, list(pushes), drifts)
