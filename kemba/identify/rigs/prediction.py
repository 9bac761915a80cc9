"""The force that a rig's logs should show, with effects switched on and sensors as they are."""

from collections.abc import Mapping
from dataclasses import replace

import casadi as ca
import numpy as np

from kemba.effects.series import Series
from kemba.identify.problem.candidates import CompiledModels, nominal_figures
from kemba.identify.problem.problem import Array, Candidate, Theta
from kemba.identify.problem.sensor_faults import SensorFaults, is_fault
from kemba.identify.rigs.rig_log import ANSWER, PLACE, Filtered, RigLog
from kemba.model.model import Model
from kemba.model.rest import StatesAlong


class Balance:
    """A model with numbers left free: `free` parameters, `scaled` figures.

    The force is what the measured motion and the measured inputs demand. A cylinder: the force on
    the rod. A drive: the measured force of the motor, plus what the balance of forces lacks.
    """

    def __init__(self, model: Model, free: tuple[str, ...], scaled: tuple[str, ...]) -> None:
        self.model, self.names = model, (*free, *scaled)
        node = model.build(free, scaled)
        self.inputs = [q.name for q in model.inputs.values()]
        self._drive = model.mechanism.rig == "drive"
        force = node.dynamics[0] + node.u[0] if self._drive else node.outputs["piston/F"]
        symbols = [node.s, node.q, node.v, node.a, node.u, node.p]
        slopes = ca.horzcat(ca.jacobian(force, node.a), ca.jacobian(force, node.u))
        self._slopes = ca.Function("slopes", symbols, [ca.densify(slopes.T)])
        moving = ca.vertcat(node.s, node.v)
        standing = ca.substitute(force, moving, ca.DM.zeros(moving.shape))
        static = ca.substitute(standing, node.a, ca.DM(0.0))
        self._bends = bool(ca.which_depends(static, node.q, 2, True)[0])
        parts = {"standing": standing, "moving": force - standing, "static": static}
        self._parts = {n: ca.Function(n, symbols, [ca.densify(x)]) for n, x in parts.items()}
        self._states = StatesAlong(model, node) if model.states else None

    def force(self, log: Filtered, values: Mapping[str, float]) -> Array:
        """Force (k,) at the judged rows; `values` holds every name of `names`.

        The measured force is behind a filter. What bends with the motion is not the same behind the
        filter as of a motion that is behind it: it is told of what was read, and filtered itself.
        Of a cylinder, whose seals stretch at a turn, turns are in doubt as far as the filter mixes.
        """
        s, q, v, a, u, p = self._arguments(log, values)

        def part(name: str, q: Array, v: Array) -> Array:
            return np.asarray(self._parts[name](s, q, v, a, u, p)).ravel()

        straight, bent = part("standing", q, v), part("moving", q, self._rate(log)[None])
        if not self._drive:
            straight, bent = straight + bent, np.zeros_like(bent)
        if self._bends:
            straight -= part("static", q, v)
            bent += part("static", log.read[None], v)
        return np.asarray((straight + log.smoothed(bent))[log.rows])

    def slopes(self, log: Filtered, values: Mapping[str, float]) -> Array:
        """Slopes (k, 1 + inputs) of the force: by the acceleration and by each input."""
        at_rows = [c[:, log.rows] for c in self._arguments(log, values)]
        return np.asarray(np.asarray(self._slopes(*at_rows)).T)

    def _arguments(self, log: Filtered, values: Mapping[str, float]) -> list[Array]:
        """States, motion, inputs and parameters (., n) along the whole log."""
        p = np.array([values[name] for name in self.names]).reshape(-1, 1)
        u = np.stack([log.others[name] for name in self.inputs])
        s, n = self._along(log, u, p[:, 0]), len(log.q)
        return [s, *(c[None] for c in (log.q, log.v, log.a)), u, np.repeat(p, n, axis=1)]

    def _rate(self, log: Filtered) -> Array:
        """The rate (n,) of which friction is told."""
        return log.quick if self._drive else log.v

    def _along(self, log: Filtered, u: Array, p: Array) -> Array:
        """States (ns, n) along the whole log; each stretch begins at rest."""
        if self._states is None:
            return np.zeros((0, len(log.time)))
        parts, rate = [], self._rate(log)
        for begin, end in zip(log.begins, np.append(log.begins[1:], len(log.time)), strict=True):
            own = slice(begin, end)
            middle = [0.5 * (c[own][1:] + c[own][:-1]) for c in (log.q, rate, log.a, *u)]
            start = self._states.rest(log.q[begin], 0.0, 0.0, u[:, begin], p)
            parts.append(self._states.run(start, np.stack([np.diff(log.time[own]), *middle]), p))
        return np.concatenate(parts, axis=1)


SEALS = "measured_chambers.travel"
TRAVEL = 0.5  # prior sigma of the travel until they slide, as a share of it
LEAST = 0.05  # smallest force of a motor over that of the log


class Predictor(CompiledModels[Balance]):
    """Balances of one model, and what its sensors make of them."""

    def __init__(self, model: Model, candidates: Mapping[str, Candidate]) -> None:
        super().__init__(model, candidates, nominal_figures(model), Balance)
        rig = model.mechanism.rig
        self.place, self.answer = PLACE[rig], ANSWER[rig]
        if rig == "cylinder":
            self.figures[SEALS] = (1.0, TRAVEL)
        self.sensors = SensorFaults(model.effects)

    def gap(self, log: RigLog, theta: Theta) -> Array:
        """Predicted less measured force (k,) at the judged rows."""
        channels, time = self.true(log.channels, theta), log.time
        expected = self.at(theta).force(channels, self._values(theta))
        measured = channels.others[self.answer][channels.rows]
        if self.answer in self.at(theta).inputs:  # in the unit of what the motor was told
            return np.asarray((expected - measured) / self._gain(theta))
        shown = self.sensors.shown(theta, self.answer, Series(time, expected))
        return np.asarray(shown.value - measured)

    def _gain(self, theta: Theta) -> float:
        """Force of the motor over the force that the log says."""
        listed = self.model.parameters.get("axis_scale.k")  # which theta scales, if there is one
        gain = theta.get("axis_scale.k", 1.0) * (listed[1] if listed else 1.0)
        return max(gain, LEAST)

    def variance(self, log: RigLog, usual: float) -> Array:
        """Variance (k,) of `gap` under the model as it is; friction of the size `usual` is in doubt
        where the sign of the rate is."""
        channels = log.channels
        slopes = self.at({}).slopes(channels, self._values({}))
        sigmas = [channels.a_sigma, *(channels.sigma[n] for n in self.at({}).inputs)]
        noise = (slopes * sigmas) ** 2
        total = noise.sum(axis=1) + (usual * log.doubt) ** 2
        if self.answer not in self.at({}).inputs:
            total = total + channels.sigma[self.answer] ** 2
        else:  # the motor's force enters once: as what was measured, in whose unit all else counts
            others = (total - noise[:, -1]) / self._gain({}) ** 2
            total = others + channels.sigma[self.answer] ** 2
        return np.asarray(total)

    def true(self, log: Filtered, theta: Theta) -> Filtered:
        """The channels without the faults of their sensors, but for the one that is predicted."""
        if not self.sensors.present and not any(is_fault(name) for name in theta):
            return log
        seen = Series(log.time, log.q, (log.v, log.a))
        moved = self.sensors.behind(theta, self.place, seen)
        others = {
            name: self.sensors.behind(theta, name, Series(log.time, y)).value
            for name, y in log.others.items()
            if name != self.answer
        }
        others[self.answer] = log.others[self.answer]
        v, a = moved.rates
        read, quick = moved.value + log.read - log.q, v + log.quick - log.v
        return replace(log, q=moved.value, v=v, a=a, others=others, read=read, quick=quick)

    def _values(self, theta: Theta) -> dict[str, float]:
        return self.values(theta, self.at(theta).names)
