"""Effect states along measured motion with exact switching, and the forces that they make."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from kemba.effects.pneumatics.switching import delayed, instants, is_on
from kemba.identify.problem.types import Array
from kemba.identify.robot.batch import Batch, ResampledLog
from kemba.identify.robot.linear import LinearisedMotion
from kemba.identify.robot.physics import Index, Physics
from kemba.identify.robot.reference import Reference


def substeps(log: ResampledLog, delays: Array) -> tuple[Array, Array, Index]:
    """(times (N + 1,), valves (valves, N), index of each node) with a time at every switching.

    `delays` (valves, 2): seconds from the command to switching on and off. As many times come back
    whatever the delays are, so that functions built for one length serve them all.
    """
    first, last = log.time[0], log.time[-1]
    events = [log.time]
    for sent, late in zip(log.sent, delays, strict=True):
        events.append(np.clip(instants(np.reshape(sent, (-1, 2)) + late), first, last))
    everything = np.concatenate(events)
    order = np.argsort(everything, kind="stable")
    times = everything[order]
    index = np.empty(len(order), int)
    index[order] = np.arange(len(order))
    middle = 0.5 * (times[1:] + times[:-1])
    acting = (delayed(sent, *late) for sent, late in zip(log.sent, delays, strict=True))
    valves = np.stack([is_on(pulses, middle) for pulses in acting])
    return times, valves, index[: len(log.time)]


@dataclass(frozen=True)
class Inputs:
    """One run cut at every switching.

    `h` (N,) [s]: steps of the integration; `given`: q, v and inputs (N, .) over them; `index` (n,)
    of each node among them; `width` (n,) [s] of each node's step. `inputs` (n, nu): mean over each
    node's step.
    """

    h: Array
    given: tuple[Array, Array, Array]
    index: Index
    width: Array
    inputs: Array

    def means(self, values: Array) -> Array:
        """(n, k): values (N, k) averaged over the step from each node."""
        return _means(values, self.h, self.index, self.width)


def _means(values: Array, h: Array, index: Index, width: Array) -> Array:
    padded = np.append(values * h[:, None], 0 * values[:1], axis=0)
    sums = np.add.reduceat(padded, index, axis=0)
    return np.vstack([(sums / width[:, None])[:-1], values[-1:]])


def read_inputs(physics: Physics, batch: Batch, ref: Reference, delays: Array) -> list[Inputs]:
    """Per run; `delays` (valves, 2) in seconds to switching on and off."""
    found = []
    for i, log in enumerate(batch.resampled):
        n = len(log.time)
        times, valves, index = substeps(log, delays)
        h = np.diff(times)
        middle = 0.5 * (times[1:] + times[:-1])
        q, v = (_at(log.time, a[:n, i], middle) for a in (ref.q, ref.v))
        held = np.clip(np.searchsorted(log.time, middle, side="right") - 1, 0, n - 1)
        u = physics.arrange(log.torque[held].T, valves).T
        width = np.append(np.diff(log.time), 1.0)
        found.append(Inputs(h, (q, v, u), index, width, _means(u, h, index, width)))
    return found


def air_states(
    physics: Physics, batch: Batch, inputs: Sequence[Inputs], p: Array, among: Index | None = None
) -> tuple[Array, Array]:
    """Effect states (n, L, ns) and inputs (n, L, nu), both the mean over each step; `among`: states
    that are asked for (None: all)."""
    moving = p[physics.moves]
    states = [d.means(physics.states.run(d.h, *d.given, moving, among)) for d in inputs]
    return batch.pad(states, 0.0), batch.pad([d.inputs for d in inputs], 0.0)


def _at(time: Array, values: Array, times: Array) -> Array:
    """Linear interpolation of (n, k) at times: (m, k)."""
    right = np.clip(np.searchsorted(time, times), 1, len(time) - 1)
    share = ((times - time[right - 1]) / (time[right] - time[right - 1]))[:, None]
    return np.asarray(values[right - 1] + share * (values[right] - values[right - 1]))


KEPT = 4  # inputs and states that are kept beside the first ones
LINES = 50_000_000  # bytes of forces that are kept: the next Jacobian asks for them


@dataclass
class ForceLine:
    """Force (N, k) at p, and its slopes (N, k) along parameters in which it is linear."""

    p: Array
    force: Array
    slopes: dict[int, Array] = field(default_factory=dict)


class Forces:
    """Force that a motion needs beyond the model, at any parameters p (k,) and delays (valves, 2)
    [s]."""

    def __init__(self, physics: Physics, batch: Batch, motion: LinearisedMotion) -> None:
        self.physics, self.batch, self.motion = physics, batch, motion
        self._inputs: dict[bytes, list[Inputs]] = {}
        self._states: dict[bytes, tuple[Array, Array]] = {}
        self._lines: dict[bytes, ForceLine] = {}

    def at(self, p: Array, delays: Array) -> Array:
        """Force (n, L, k) that the motion needs beyond model and contact."""
        return self.batch.deep(self._force(p, delays)) - self.motion.contact

    def slopes(self, p: Array, delays: Array) -> Array:
        """d force / dp (N, k, len(p)) at the samples."""
        given = (*self.motion.middle, *self.states(p, delays, None))
        return self.physics.call("by_parameter", *given, p=p)[0]

    def states(self, p: Array, delays: Array, among: Index | None) -> tuple[Array, Array]:
        """Effect states (N, ns) and inputs (N, nu) at the samples; `among`: states that are asked
        for (None: all)."""
        wanted = b"" if among is None else among.tobytes()
        key = delays.tobytes() + p[self.physics.moves].tobytes() + wanted
        if key not in self._states:
            given = self._inputs.get(delays.tobytes())
            if given is None:
                given = read_inputs(self.physics, self.batch, self.motion.ref, delays)
                _keep(self._inputs, delays.tobytes(), given, KEPT)
            states, inputs = air_states(self.physics, self.batch, given, p, among)
            _keep(self._states, key, (self.batch.flat(states), self.batch.flat(inputs)), KEPT)
        return self._states[key]

    def _force(self, p: Array, delays: Array) -> Array:
        straight, crossed = self.physics.straight
        key = delays.tobytes() + p[~straight].tobytes()
        line = self._lines.get(key)
        if line is None:
            line = ForceLine(p.copy(), self._exact(p, delays))
            _keep(self._lines, key, line, max(KEPT, LINES // line.force.nbytes))
        moved = np.flatnonzero(p != line.p)
        if crossed[np.ix_(moved, moved)].any():
            return self._exact(p, delays)
        force = line.force
        for i in moved.tolist():
            if i not in line.slopes:
                one = line.p.copy()
                one[i] += 1.0
                line.slopes[i] = self._exact(one, delays) - line.force
            force = force + (p[i] - line.p[i]) * line.slopes[i]
        return force

    def _exact(self, p: Array, delays: Array) -> Array:
        states = self.states(p, delays, self.physics.states_at(p))
        return self.physics.call("residual", *self.motion.middle, *states, p=p)[0]


def _keep(store: dict[bytes, Any], key: bytes, value: Any, most: int) -> None:
    """Add to a store that holds the first one and the last ones, `most` of them."""
    if len(store) > most:
        del store[list(store)[1]]
    store[key] = value
