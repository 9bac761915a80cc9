"""The force that a rig's logs should show, with effects switched on and sensors as they are."""

from collections.abc import Mapping
from dataclasses import replace

import casadi as ca
import numpy as np

from kemba.effects.series import Series
from kemba.identify.problem.candidates import CompiledModels, OpenModel
from kemba.identify.problem.problem import Array, Candidate, Theta
from kemba.identify.problem.sensor_faults import is_fault
from kemba.identify.rigs.rig_log import ANSWER, PLACE, RigLog
from kemba.machine_code import SampleMap
from kemba.model.model import Model


class Balance(OpenModel):
    """The balance of forces of a cylinder or a drive.

    The force is what the measured motion and the measured inputs demand. A cylinder: the force on
    the rod. A drive: the measured force of the motor, plus what the balance of forces lacks.
    """

    def __init__(self, model: Model, free: tuple[str, ...], scaled: tuple[str, ...]) -> None:
        super().__init__(model, free, scaled)
        node = self.node
        self.inputs = [q.name for q in model.inputs.values()]
        self._drive = model.mechanism.rig == "drive"
        force = node.dynamics[0] + node.u[0] if self._drive else node.outputs["piston/F"]
        symbols = [node.s, node.q, node.v, node.a, node.u, node.p]
        slopes = ca.horzcat(ca.jacobian(force, node.a), ca.jacobian(force, node.u))
        self._slopes = SampleMap(symbols, [slopes.T])
        moving = ca.vertcat(node.s, node.v)
        standing = ca.substitute(force, moving, ca.DM.zeros(moving.shape))
        static = ca.substitute(standing, node.a, ca.DM(0.0))
        self._bends = bool(ca.which_depends(static, node.q, 2, True)[0])
        parts = {"standing": standing, "moving": force - standing, "static": static}
        self._parts = {n: SampleMap(symbols, [x]) for n, x in parts.items()}

    def force(self, log: RigLog, values: Mapping[str, float]) -> Array:
        """Force (k,) at the judged rows; `values` holds every name of `names`.

        The measured force is behind a filter. What bends with the motion is not the same behind the
        filter as of a motion that is behind it: it is told of what was read, and filtered itself.
        Of a cylinder, whose seals stretch at a turn, turns are in doubt as far as the filter mixes.
        """
        (s, _, v, a, u), p = self._arguments(log, values)

        def part(name: str, q: Array, v: Array) -> Array:
            return self._parts[name]([s, q[:, None], v, a, u], p)[0][:, 0]

        straight, bent = part("standing", log.q, v), part("moving", log.q, self._rate(log)[:, None])
        if not self._drive:
            straight, bent = straight + bent, np.zeros_like(bent)
        if self._bends:
            straight -= part("static", log.q, v)
            bent += part("static", log.read, v)
        return np.asarray((straight + log.smoothed(bent))[log.rows])

    def slopes(self, log: RigLog, values: Mapping[str, float]) -> Array:
        """Slopes (k, 1 + inputs) of the force: by the acceleration and by each input."""
        samples, p = self._arguments(log, values)
        return self._slopes([c[log.rows] for c in samples], p)[0]

    def _arguments(self, log: RigLog, values: Mapping[str, float]) -> tuple[list[Array], Array]:
        """States, motion and inputs (n, .) along the whole log, and parameters (k,)."""
        p = self.parameters(values)
        u = np.stack([log.others[name] for name in self.inputs], axis=1)
        return [self._along(log, u, p), *(c[:, None] for c in (log.q, log.v, log.a)), u], p

    def _rate(self, log: RigLog) -> Array:
        """The rate (n,) of which friction is told."""
        return log.quick if self._drive else log.v

    def _along(self, log: RigLog, u: Array, p: Array) -> Array:
        """States (n, ns) along the whole log; each stretch begins at rest."""
        parts, whole = [], np.column_stack([log.q, self._rate(log), log.a, u])
        for begin, end in zip(log.begins, np.append(log.begins[1:], len(log.grid)), strict=True):
            own = whole[begin:end]
            middle = np.column_stack([np.diff(log.grid[begin:end]), 0.5 * (own[1:] + own[:-1])])
            start = self.along.rest(log.q[begin], 0.0, 0.0, u[begin], p)
            parts.append(self.along.run(start, middle, p)[0])
        return np.concatenate(parts)


SEALS = "measured_chambers.travel"
TRAVEL = 0.5  # prior sigma of the travel until they slide, as a share of it
LEAST = 0.05  # smallest force of a motor over that of the log


class Predictor(CompiledModels[Balance]):
    """Balances of one model, and what its sensors make of them."""

    def __init__(self, model: Model, candidates: Mapping[str, Candidate]) -> None:
        super().__init__(model, candidates, Balance)
        rig = model.mechanism.rig
        self.place, self.answer = PLACE[rig], ANSWER[rig]
        if rig == "cylinder":
            self.figures[SEALS] = (1.0, TRAVEL)

    def gap(self, log: RigLog, theta: Theta) -> Array:
        """Predicted less measured force (k,) at the judged rows."""
        log = self.true(log, theta)
        expected = self.at(theta).force(log, self.values(theta))
        measured = log.others[self.answer][log.rows]
        if self.answer in self.at(theta).inputs:  # in the unit of what the motor was told
            return np.asarray((expected - measured) / self._gain(theta))
        shown = self.sensors.shown(theta, self.answer, Series(log.time, expected))
        return np.asarray(shown.value - measured)

    def _gain(self, theta: Theta) -> float:
        """Force of the motor over the force that the log says."""
        listed = self.model.parameters.get("axis_scale.k")  # which theta scales, if there is one
        gain = theta.get("axis_scale.k", 1.0) * (listed[1] if listed else 1.0)
        return max(gain, LEAST)

    def variance(self, log: RigLog, usual: float) -> Array:
        """Variance (k,) of `gap` under the model as it is; friction of the size `usual` is in doubt
        where the sign of the rate is."""
        slopes = self.at({}).slopes(log, self.values({}))
        sigmas = [log.a_sigma, *(log.sigma[n] for n in self.at({}).inputs)]
        noise = (slopes * sigmas) ** 2
        total = noise.sum(axis=1) + (usual * log.doubt) ** 2
        if self.answer not in self.at({}).inputs:
            total = total + log.sigma[self.answer] ** 2
        else:  # the motor's force enters once: as what was measured, in whose unit all else counts
            others = (total - noise[:, -1]) / self._gain({}) ** 2
            total = others + log.sigma[self.answer] ** 2
        return np.asarray(total)

    def true(self, log: RigLog, theta: Theta) -> RigLog:
        """The channels without the faults of their sensors, but for the one that is predicted."""
        if not self.sensors.present and not any(is_fault(name) for name in theta):
            return log
        seen = Series(log.grid, log.q, (log.v, log.a))
        moved = self.sensors.behind(theta, self.place, seen)
        others = {
            name: self.sensors.behind(theta, name, Series(log.grid, y)).value
            for name, y in log.others.items()
            if name != self.answer
        }
        others[self.answer] = log.others[self.answer]
        v, a = moved.rates
        read, quick = moved.value + log.read - log.q, v + log.quick - log.v
        return replace(log, q=moved.value, v=v, a=a, others=others, read=read, quick=quick)
