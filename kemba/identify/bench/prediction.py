"""What a bench log should read under a model, with effects on its list and sensors as they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from kemba.effects.base import Effect
from kemba.effects.pneumatics.constants import ATMOSPHERE
from kemba.effects.pneumatics.switching import delayed
from kemba.effects.series import Series
from kemba.identify.bench.bench_log import PRESSURES, BenchLog
from kemba.identify.bench.clocks import commands_by_one_clock, motion_by_one_clock
from kemba.identify.bench.motion import SmoothedMotion
from kemba.identify.bench.rig_model import Prediction, RigModel, share
from kemba.identify.problem.candidates import by_default, switched_on
from kemba.identify.problem.nominal import nominal_figures
from kemba.identify.problem.problem import Array, Candidate, Theta
from kemba.identify.problem.sensor_faults import SensorFaults
from kemba.mechanism import Cylinder
from kemba.model.model import Model

SENT_LATE = "sent:late"  # nuisance of slow logs [s]: by how much all commands were sent later


class BenchPredictor:
    """Rigs of one model, each compiled once with the effects that theta switches on.

    `figures`: nominal numbers of the model that theta may scale, with factor and 1 sigma, by name.
    `exact`: what a late force sensor shows is computed at its own times, not read off between rows.
    """

    exact = False

    def __init__(self, model: Model, candidates: Mapping[str, Candidate]) -> None:
        self.model, self.candidates = model, candidates
        self.figures = nominal_figures(model)
        self.sensors = SensorFaults(model.effects)
        self._rigs: dict[tuple[str, ...], RigModel] = {}

    def rig(self, theta: Theta) -> RigModel:
        """The rig with the effects on its list that theta switches on."""
        active = switched_on(self.candidates, theta)
        if active not in self._rigs:
            extra = [by_default(self.candidates[name].effect) for name in active]
            model = self.model.with_effects(_unlike(self.model, extra))
            keys = (key for name in active for key in tuple(self.candidates[name].keys()))
            free = tuple(key for key in keys if key in model.parameters)
            self._rigs[active] = RigModel(model, free, tuple(self.figures))
        return self._rigs[active]

    def predict(
        self, run: BenchLog, theta: Theta, start: Mapping[str, float] | None = None
    ) -> Prediction:
        """What happens on the rig, before any sensor; where `exact`, at the times that the force of
        a row is of. `start`: by how much states differ from rest when the log begins."""
        rig = self.rig(theta)
        nominal = {name: factor for name, (factor, _) in self.figures.items()}
        values = {name: theta.get(name, nominal.get(name, 0.0)) for name in rig.names}
        sent = self.sent(run, theta)
        late = self._shift(theta)
        return rig.predict(self.true_motion(run, theta), sent.commands, values, start or {}, late)

    def _shift(self, theta: Theta) -> float:
        """Seconds before every row at which the rig is predicted."""
        return self.sensors.lateness(theta, "piston/F") if self.exact else 0.0

    def sent(self, run: BenchLog, theta: Theta) -> BenchLog:
        """A run with its commands at the time when they were sent, at theta."""
        late = theta.get(SENT_LATE, 0.0) if run.seen_within else 0.0
        return commands_by_one_clock(run.sent(late) if late else run, theta)

    def true_motion(self, run: BenchLog, theta: Theta) -> SmoothedMotion:
        """The motion that made the position sensor say what it said."""
        motion = motion_by_one_clock(run.motion, theta)
        seen = Series(motion.time, motion.x, (motion.v, motion.a))
        true = self.sensors.behind(theta, "piston/x", seen)
        v, a = true.rates
        return motion if true is seen else replace(motion, x=true.value, v=v, a=a)

    def readings(
        self, run: BenchLog, theta: Theta, start: Mapping[str, float]
    ) -> dict[str, tuple[Array, Array]]:
        """Per channel (n,): what should have been measured, and its variance."""
        p = self.predict(run, theta, start)
        out = {"piston/F": self._force(p, run, theta)}
        cylinder = self.model.mechanism.need_cylinder()
        for channel in PRESSURES:
            if channel in run.measured:
                seen = Series(run.motion.time, absolute_pressure(channel, p.states, cylinder))
                value = self.sensors.shown(theta, channel, seen.late(-self._shift(theta))).value
                out[channel] = (value, run.variance(channel))
        return out

    def _force(self, p: Prediction, run: BenchLog, theta: Theta) -> tuple[Array, Array]:
        """The transducer's reading and its variance: sensor, velocity error, switching instants."""
        time, shown = run.motion.time, self.sensors.scaled if self.exact else self.sensors.shown
        force = shown(theta, "piston/F", Series(time, p.force)).value
        late = self.sensors.lateness(theta, "piston/F") - self._shift(theta)
        valve = Series(time, p.valve).late(late).value
        variance = run.variance("piston/F") + run.velocity_error**2
        variance = variance + np.sum(p.by_valve**2 * valve * (1 - valve), axis=1)
        return force, variance

    def acting(self, run: BenchLog, theta: Theta) -> Array:
        """Share of each sample's neighbourhood in which the valves act (n, 2)."""
        delays = self.rig(theta).timing(theta)
        times = run.motion.time
        sent = self.sent(run, theta).commands
        return np.stack([share(delayed(c, *delays), times) for c in sent], axis=1)


def _unlike(model: Model, extra: list[Effect]) -> list[Effect]:
    """Effects not on the model's list already; those that are stay as they are."""
    names = {e.name for e in model.effects}
    return [e for e in extra if e.name not in names]


def absolute_pressure(channel: str, states: Mapping[str, Array], cylinder: Cylinder) -> Array:
    """[Pa] in a chamber, from its force state, or its own pressure state where it has one."""
    chamber = channel.split("/")[1]
    if f"chamber/{chamber}/P" in states:
        return states[f"chamber/{chamber}/P"]
    area = cylinder.area_extend if chamber == "extend" else cylinder.area_retract
    with np.errstate(over="ignore"):  # the states of a model far from the data may diverge
        return np.asarray(ATMOSPHERE + states[f"chamber/{chamber}/F"] / area)
