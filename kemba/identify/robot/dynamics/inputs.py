"""What drives the air: motion, torques and exact switching along a reference, made ready once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from kemba.identify.robot.dynamics.air import Index, substeps
from kemba.identify.robot.dynamics.physics import Physics
from kemba.identify.robot.dynamics.reference import Reference
from kemba.identify.robot.motion.batch import Batch

Array = np.ndarray[Any, np.dtype[np.float64]]


@dataclass(frozen=True)
class Inputs:
    """One run cut at every switching: `given` are steps, q, v and inputs of the integration;
    `h` (N,) the steps, `index` of each node among them."""

    given: tuple[ca.DM, ca.DM, ca.DM, ca.DM]
    h: Array
    index: Index
    width: Array  # (n,) of each node's step
    inputs: Array  # (n, nu), the mean over each step

    def means(self, values: Array) -> Array:
        """(n, k): values (k, N) averaged over the step from each node."""
        padded = np.append(values * self.h, 0 * values[:, :1], axis=1)
        sums = np.add.reduceat(padded, self.index, axis=1)
        return np.vstack([(sums / self.width).T[:-1], values[:, -1:].T])


def read_inputs(physics: Physics, batch: Batch, ref: Reference, delays: Array) -> list[Inputs]:
    """Per run; `delays` (valves, 2) in seconds to switching on and off."""
    found = []
    for i, track in enumerate(batch.resampled):
        n = len(track.time)
        times, valves, index = substeps(track, delays)
        h = np.diff(times)
        middle = 0.5 * (times[1:] + times[:-1])
        q, v = (_at(track.time, a[:n, i], middle) for a in (ref.q, ref.v))
        held = np.clip(np.searchsorted(track.time, middle, side="right") - 1, 0, n - 1)
        u = physics.arrange(track.torque[held].T, valves)
        given = tuple(ca.DM(a) for a in (h[None, :], q, v, u))
        width = np.append(np.diff(track.time), 1.0)
        drive = Inputs(given, h, index, width, np.empty(0))  # type: ignore[arg-type]
        found.append(Inputs(drive.given, h, index, width, drive.means(u)))
    return found


def air_states(
    physics: Physics, batch: Batch, driven: Sequence[Inputs], p: Array
) -> tuple[Array, Array]:
    """Effect states (n, L, ns) and inputs (n, L, nu), both the mean over each step."""
    moving = p[physics.moves]
    states = [d.means(physics.states.run(*d.given, moving)) for d in driven]
    return batch.pad(states, 0.0), batch.pad([d.inputs for d in driven], 0.0)


def _at(time: Array, values: Array, times: Array) -> Array:
    """Linear interpolation of (n, k) at times: (k, m)."""
    right = np.clip(np.searchsorted(time, times), 1, len(time) - 1)
    share = ((times - time[right - 1]) / (time[right] - time[right - 1]))[:, None]
    return np.asarray((values[right - 1] + share * (values[right] - values[right - 1])).T)
