"""What drives the air: motion, torques and exact switching along a reference, made ready once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kemba.identify.problem.types import Array
from kemba.identify.robot.dynamics.air import Index, substeps
from kemba.identify.robot.dynamics.physics import Physics
from kemba.identify.robot.dynamics.reference import Reference
from kemba.identify.robot.motion.batch import Batch


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
    physics: Physics,
    batch: Batch,
    inputs: Sequence[Inputs],
    p: Array,
    among: Index | None = None,
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
