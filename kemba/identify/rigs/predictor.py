"""The force that a rig's logs should show, with effects switched on and sensors as they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from kemba.effects.series import Series
from kemba.identify.problem.candidates import by_default, switched_on
from kemba.identify.problem.nominal import nominal_figures
from kemba.identify.problem.sensor_faults import SensorFaults, is_fault
from kemba.identify.problem.types import Array, Candidate, Theta
from kemba.identify.rigs.balance import Balance
from kemba.identify.rigs.filtering import Filtered
from kemba.identify.rigs.rig_log import ANSWER, PLACE, RigLog
from kemba.model.model import Model

SEALS = "measured_chambers.travel"


class SealSettings:
    """How well it is known how far seals stretch."""

    travel = 0.5  # prior sigma of the travel until they slide, as a share of it


class GainSettings:
    """What a motor's scale may be."""

    least = 0.05  # smallest force of a motor over that of the log


class Predictor:
    """Balances of one model, each compiled once with the effects that theta switches on.

    `figures`: nominal numbers of the model that theta may scale, with factor and 1 sigma, by name.
    """

    def __init__(self, model: Model, candidates: Mapping[str, Candidate]) -> None:
        self.model, self.candidates = model, candidates
        rig = model.mechanism.rig
        self.place, self.answer = PLACE[rig], ANSWER[rig]
        self.figures = nominal_figures(model)
        if rig == "cylinder":
            self.figures[SEALS] = (1.0, SealSettings.travel)
        self.sensors = SensorFaults(model.effects)
        self._known: dict[tuple[str, ...], Balance] = {}

    def balance(self, theta: Theta) -> Balance:
        """The balance with the effects on its list that theta switches on."""
        active = switched_on(self.candidates, theta)
        if active not in self._known:
            model = self.model.with_effects(by_default(name) for name in active)
            keys = (key for name in active for key in tuple(self.candidates[name].keys()))
            free = tuple(key for key in keys if key in model.parameters)
            self._known[active] = Balance(model, free, tuple(self.figures))
        return self._known[active]

    def gap(self, log: RigLog, theta: Theta) -> Array:
        """Predicted less measured force (k,) at the judged rows."""
        channels, time = self.true(log.channels, theta), log.time
        expected = self.balance(theta).force(channels, self._values(theta))
        measured = channels.others[self.answer][channels.rows]
        if self.answer in self.balance(theta).inputs:  # in the unit of what the motor was told
            return np.asarray((expected - measured) / self._gain(theta))
        shown = self.sensors.shown(theta, self.answer, Series(time, expected))
        return np.asarray(shown.value - measured)

    def _gain(self, theta: Theta) -> float:
        """Force of the motor over the force that the log says."""
        listed = self.model.parameters.get("axis_scale.k")  # which theta scales, if there is one
        gain = theta.get("axis_scale.k", 1.0) * (listed[1] if listed else 1.0)
        return max(gain, GainSettings.least)

    def variance(self, log: RigLog, usual: float) -> Array:
        """Variance (k,) of `gap` under the model as it is; friction of the size `usual` is in doubt
        where the sign of the rate is."""
        channels = log.channels
        slopes = self.balance({}).slopes(channels, self._values({}))
        sigmas = [channels.a_sigma, *(channels.sigma[n] for n in self.balance({}).inputs)]
        noise = (slopes * sigmas) ** 2
        total = noise.sum(axis=1) + (usual * log.doubt) ** 2
        if self.answer not in self.balance({}).inputs:
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
        read = moved.value + log.read - log.q
        return replace(log, q=moved.value, v=v, a=a, others=others, read=read)

    def _values(self, theta: Theta) -> dict[str, float]:
        nominal = {name: factor for name, (factor, _) in self.figures.items()}
        return {name: theta.get(name, nominal.get(name, 0.0)) for name in self.balance(theta).names}
