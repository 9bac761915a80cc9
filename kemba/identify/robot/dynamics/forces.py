"""Forces of the model along a reference at any parameters; results that recur are kept."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from kemba.identify.problem.types import Array
from kemba.identify.robot.dynamics.air import Index
from kemba.identify.robot.dynamics.inputs import Inputs, air_states, read_inputs
from kemba.identify.robot.dynamics.linear import LinearisedMotion
from kemba.identify.robot.dynamics.physics import Physics
from kemba.identify.robot.motion.batch import Batch


class ForcesSettings:
    """What is kept of computed forces."""

    kept = 4  # inputs and states that are kept beside the first ones
    lines = 50_000_000  # bytes of forces that are kept: the next Jacobian asks for them


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
        key = delays.tobytes() + p[self.physics.moves].tobytes() + bytes([among is None])
        if key not in self._states:
            kept = ForcesSettings.kept
            given = self._inputs.get(delays.tobytes())
            if given is None:
                given = read_inputs(self.physics, self.batch, self.motion.ref, delays)
                _keep(self._inputs, delays.tobytes(), given, kept)
            states, inputs = air_states(self.physics, self.batch, given, p, among)
            _keep(self._states, key, (self.batch.flat(states), self.batch.flat(inputs)), kept)
        return self._states[key]

    def _force(self, p: Array, delays: Array) -> Array:
        straight, crossed = self.physics.straight
        key = delays.tobytes() + p[~straight].tobytes()
        line = self._lines.get(key)
        if line is None:
            line = ForceLine(p.copy(), self._exact(p, delays))
            settings = ForcesSettings
            _keep(self._lines, key, line, max(settings.kept, settings.lines // line.force.nbytes))
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
