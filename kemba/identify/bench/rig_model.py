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
from kemba.model.exponential import midpoint_step
from kemba.model.model import Model
from kemba.model.node import Node
from kemba.model.rest import Rest, rate_of

# The velocity is known within v_sigma: the force is its mean over three Gauss-Hermite nodes
V_NODES, V_MIDDLE = ((-np.sqrt(3.0), 1 / 6), (np.sqrt(3.0), 1 / 6)), 2 / 3  # sigma, weight

Pulses = tuple[list[Pulse], list[Pulse]]  # of the extend and the retract valve
STEP = 1.5e-3  # longest step [s]: a fifth of the fastest rise time of Table I, 8 ms
CHUNK = 512  # steps per call of a compiled function
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
        rate = rate_of(node)
        inputs = [node.s, node.q, node.v, node.a, node.u, node.p]
        self._rest = Rest(node.s, inputs[1:], rate, list(model.states.values()))
        force = node.outputs["piston/F"]
        results = ca.vertcat(force, ca.jacobian(force, node.u).T)
        self._functions = {
            "step": _step(node, rate),
            "force": ca.Function("force", inputs, [ca.densify(force)]),
            "output": ca.Function("output", inputs, [ca.densify(results)]),
        }
        self._maps: dict[tuple[str, int], _Call] = {}

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
        out = self._mapped("output", n)(s, x, v0, a, blurred, fixed)
        force = V_MIDDLE * out[0]
        for place, weight in V_NODES:
            v = v0 + place * motion.v_sigma
            force += weight * self._mapped("force", n)(s, x, v, a, blurred, fixed)[0]
        return Prediction(force, out[1:3].T, blurred.T, states)

    def _integrate(
        self, times: Array, motion: SmoothedMotion, u: Array, p: Array, start: Mapping[str, float]
    ) -> Array:
        middle = 0.5 * (times[:-1] + times[1:])
        s0 = self._rest(motion.x[0], 0.0, 0.0, u[:, 0], p)
        s0 += np.array([start.get(name, 0.0) for name in self.state_names])
        n = len(times) - 1
        moved = [np.interp(middle, motion.time, c) for c in (motion.x, motion.v, motion.a)]
        inputs = np.stack([np.diff(times), *moved, *u[:, :-1]])
        inputs = np.pad(inputs, ((0, 0), (0, -n % CHUNK)))  # steps of no length at the end
        fixed = np.repeat(p[:, None], CHUNK, axis=1)
        step, states = self._mapped("step", CHUNK), [s0[:, None]]
        for i in range(0, inputs.shape[1], CHUNK):
            states.append(step(states[-1][:, -1], inputs[:, i : i + CHUNK], fixed))
        return np.concatenate(states, axis=1)[:, : n + 1]

    def _mapped(self, kind: str, n: int) -> _Call:
        if (kind, n) not in self._maps:
            one = self._functions[kind]
            self._maps[kind, n] = _Call(one.mapaccum(n) if kind == "step" else one.map(n))
        return self._maps[kind, n]


class _Call:
    """A CasADi function called on NumPy arrays without copying element by element."""

    def __init__(self, function: ca.Function) -> None:
        self._buffer, self._evaluate = function.buffer()
        self._function, self._shape = function, function.size_out(0)

    def __call__(self, *arguments: Array) -> Array:
        kept = [np.asfortranarray(a, dtype=float).reshape(-1, order="F") for a in arguments]
        for i, a in enumerate(kept):
            self._buffer.set_arg(i, memoryview(a))  # type: ignore[call-arg, arg-type]
        out = np.zeros(self._shape[0] * self._shape[1])
        self._buffer.set_res(0, memoryview(out))  # type: ignore[call-arg, arg-type]
        self._evaluate()
        return out.reshape(self._shape, order="F")


def _step(node: Node, rate: ca.SX) -> ca.Function:
    """(s, d, p) -> s after one step; d: its length, x, v and a in its middle, the two valves."""
    d = ca.SX.sym("d", 6)
    inputs = [node.q, node.v, node.a, node.u, node.p]
    given = [d[1], d[2], d[3], d[4:6], node.p]
    after, _ = midpoint_step(rate, node.s, inputs, given, d[0])
    return ca.Function("step", [node.s, d, node.p], [ca.densify(after)], {"cse": True})


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
