"""The rig's chambers driven by an imposed motion: fast prediction of the rod force."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from kemba.effects.pneumatics.switching import Pulse, delayed, instants, is_on
from kemba.effects.series import Series
from kemba.identify.bench.motion import SmoothedMotion
from kemba.identify.problem.types import Array
from kemba.model.along import StatesAlong
from kemba.model.model import Model
from kemba.model.rest import Buffered

# The velocity is known within v_sigma: the force is its mean over three Gauss-Hermite nodes
V_NODES, V_MIDDLE = ((-np.sqrt(3.0), 1 / 6), (np.sqrt(3.0), 1 / 6)), 2 / 3  # sigma, weight

Pulses = tuple[list[Pulse], list[Pulse]]  # of the extend and the retract valve
STEP = 1.5e-3  # longest step [s]: a fifth of the fastest rise time of Table I, 8 ms
# time around a switching in which its effect on a sample is uncertain [s]: over half a row of 1
# ms; a log does not say on which side its sample was taken
BLUR = 0.75e-3


@dataclass(frozen=True)
class Prediction:
    """Rod force and chamber forces at the samples, with the force's local sensitivities."""

    force: Array
    by_valve: Array  # (n, 2) dF/du
    valve: Array  # (n, 2) share of the sample's neighbourhood in which each valve is on
    states: dict[str, Array]


class RigModel:
    """One model compiled with some numbers left open: `free` parameters, `scaled` tables."""

    def __init__(self, model: Model, free: tuple[str, ...], scaled: tuple[str, ...]) -> None:
        self.model, self.names = model, (*free, *scaled)
        node = model.build(free, scaled)
        self.state_names = tuple(q.name for q in model.states.values())
        self._along = StatesAlong(model, node)
        inputs = [node.s, node.q, node.v, node.a, node.u, node.p]
        force = node.outputs["piston/F"]
        results = ca.vertcat(force, ca.jacobian(force, node.u).T)
        self._functions = {
            "force": ca.Function("force", inputs, [ca.densify(force)]),
            "output": ca.Function("output", inputs, [ca.densify(results)]),
        }
        self._maps: dict[tuple[str, int], Buffered] = {}

    def timing(self, values: Mapping[str, float]) -> tuple[float, float]:
        """Seconds by which the valves switch on and off late, with these parameters."""
        (leg,) = self.model.mechanism.legs
        return self.model.timing(leg, values)

    def predict(
        self,
        motion: SmoothedMotion,
        commands: Pulses,
        values: Mapping[str, float],
        start: Mapping[str, float] | None = None,
        late: float = 0.0,
    ) -> Prediction:
        """Integrate from rest (plus `start` by state name) with exact switching instants.

        `values` holds every name this rig was compiled for. `late` [s]: the samples are of what was
        so much earlier. A late sensor is told from late valves by the motion alone: what falls
        between two samples must look the same, so nothing is read off between them.
        """
        on, off = self.timing(values)
        valves = [delayed(c, on, off) for c in commands]
        p = np.array([values[name] for name in self.names])
        seen = motion.time - late
        times, at_sample = _breakpoints(seen, np.concatenate([instants(v) for v in valves]))
        u = np.stack([is_on(v, times) for v in valves])
        s = self._integrate(times, motion, u, p, start or {})[:, at_sample]
        blurred = np.stack([share(v, seen) for v in valves])
        n, moved = len(seen), Series(motion.time, motion.x, (motion.v, motion.a)).late(late)
        x, (v0, a) = moved.value, moved.rates
        fixed = np.repeat(p[:, None], n, axis=1)
        states = dict(zip(self.state_names, s, strict=True))
        out = self._mapped("output", n)(s, x, v0, a, blurred, fixed)[0].copy()
        force = V_MIDDLE * out[0]
        for place, weight in V_NODES:
            v = v0 + place * motion.v_sigma
            force += weight * self._mapped("force", n)(s, x, v, a, blurred, fixed)[0][0]
        return Prediction(force, out[1:3].T, blurred.T, states)

    def _integrate(
        self, times: Array, motion: SmoothedMotion, u: Array, p: Array, start: Mapping[str, float]
    ) -> Array:
        middle = 0.5 * (times[:-1] + times[1:])
        s0 = self._along.rest(motion.x[0], 0.0, 0.0, u[:, 0], p)
        s0 += np.array([start.get(name, 0.0) for name in self.state_names])
        moved = [np.interp(middle, motion.time, c) for c in (motion.x, motion.v, motion.a)]
        return self._along.run(s0, np.stack([np.diff(times), *moved, *u[:, :-1]]), p)

    def _mapped(self, kind: str, n: int) -> Buffered:
        if (kind, n) not in self._maps:
            self._maps[kind, n] = Buffered(self._functions[kind].map(n))
        return self._maps[kind, n]


def _breakpoints(samples: Array, events: Array) -> tuple[Array, Any]:
    """Times of samples, switching instants and sub-steps (m,), and places (n,) of the samples.

    m depends on the number of events only, so that compiled functions can be used again.
    """
    inside = np.clip(events, samples[0], samples[-1])
    pieces = np.ceil(np.diff(samples) / STEP - 1e-6).astype(int)
    fill = [
        np.linspace(samples[i], samples[i + 1], pieces[i] + 1)[1:-1]
        for i in np.flatnonzero(pieces > 1)
    ]
    times = np.concatenate([samples, inside, *fill])
    order = np.argsort(times, kind="stable")
    place = np.empty(len(times), dtype=int)
    place[order] = np.arange(len(times))
    return times[order], place[: len(samples)]


def share(intervals: Array, times: Array) -> Array:
    """Share of [t - blur, t + blur] in which the valve is on: continuous in any delay."""
    flat = np.clip(intervals, times[0] - 1.0, times[-1] + 1.0).ravel()
    if not len(flat):
        return np.zeros(len(times))
    knots = np.concatenate([[times[0] - 1.5], flat, [times[-1] + 1.5]])
    slope = np.arange(len(knots) - 1) % 2
    on_time = np.concatenate([[0.0], np.cumsum(slope * np.diff(knots))])
    later = np.interp(times + BLUR, knots, on_time)
    earlier = np.interp(times - BLUR, knots, on_time)
    return np.asarray(np.clip((later - earlier) / (2 * BLUR), 0.0, 1.0))
