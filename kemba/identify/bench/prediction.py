"""What a bench log should read under a model, with effects on its list and sensors as they are."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from kemba.effects.pneumatics.flow import ATMOSPHERE
from kemba.effects.pneumatics.switching import delayed
from kemba.effects.series import Series
from kemba.identify.bench.bench_log import PRESSURES, BenchLog
from kemba.identify.bench.clocks import commands_by_one_clock, motion_by_one_clock
from kemba.identify.bench.motion import SmoothedMotion
from kemba.identify.bench.rig_model import Prediction, RigModel, share
from kemba.identify.problem.candidates import CompiledModels, nominal_figures
from kemba.identify.problem.sensor_faults import SensorFaults
from kemba.identify.problem.types import Array, Candidate, Theta
from kemba.mechanism import Cylinder
from kemba.model.model import Model

SENT_LATE = "sent:late"  # nuisance of slow logs [s]: by how much all commands were sent later


class BenchPredictor(CompiledModels[RigModel]):
    """Rigs of one model.

    `exact`: what a late force sensor shows is computed at its own times, not read off between rows.
    """

    exact = False

    def __init__(self, model: Model, candidates: Mapping[str, Candidate]) -> None:
        super().__init__(model, candidates, nominal_figures(model), RigModel)
        self.sensors = SensorFaults(model.effects)

    def predict(
        self, run: BenchLog, theta: Theta, start: Mapping[str, float] | None = None
    ) -> Prediction:
        """What happens on the rig, before any sensor; where `exact`, at the times that the force of
        a row is of. `start`: by how much states differ from rest when the log begins."""
        rig, sent, late = self.at(theta), self.sent(run, theta), self._shift(theta)
        values = self.values(theta, rig.names)
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
        delays = self.at(theta).timing(theta)
        times = run.motion.time
        sent = self.sent(run, theta).commands
        return np.stack([share(delayed(c, *delays), times) for c in sent], axis=1)


def absolute_pressure(channel: str, states: Mapping[str, Array], cylinder: Cylinder) -> Array:
    """[Pa] in a chamber, from its force state, or its own pressure state where it has one."""
    chamber = channel.split("/")[1]
    if f"chamber/{chamber}/P" in states:
        return states[f"chamber/{chamber}/P"]
    area = cylinder.area_extend if chamber == "extend" else cylinder.area_retract
    with np.errstate(over="ignore"):  # the states of a model far from the data may diverge
        return np.asarray(ATMOSPHERE + states[f"chamber/{chamber}/F"] / area)


# beginning of a log that tells whether a valve had just been switched [s]: twice the slowest
# rise time of Table I
EARLY = 0.08


def standardised(log: BenchLog, readings: Mapping[str, tuple[Array, Array]]) -> dict[str, Array]:
    """Channel -> (predicted - measured) / sigma (k,) of the rows that count.

    `readings`: channel -> predicted values (n,) and variances (n,).
    """
    return {
        c: ((y - log.measured[c]) / np.sqrt(variance))[log.keep[c]]
        for c, (y, variance) in readings.items()
    }


def settle_starts(logs: Iterable[BenchLog], predictor: BenchPredictor) -> tuple[BenchLog, ...]:
    """The logs with the first valve pulse as the data have it.

    A valve that is on in the first row may have been on for long, or may just have been switched.
    The force in the first moments decides.
    """
    return tuple(_timed(_settled(log, predictor), predictor) for log in logs)


def _timed(log: BenchLog, predictor: BenchPredictor) -> BenchLog:
    """A slow log with the variance that the unknown moments of its switchings make.

    Each command was sent at any time between two rows. So its moment has the standard deviation of
    a row over sqrt(12), and a reading that of the change between the first and the last moment.
    """
    if not log.seen_within:
        return log
    early, late = (predictor.readings(log.sent(by * log.seen_within), {}, {}) for by in (-0.5, 0.5))
    changes = {c: late[c][0] - early[c][0] for c in log.measured}
    return replace(log, by_timing={c: change**2 / 12.0 for c, change in changes.items()})


def _settled(log: BenchLog, predictor: BenchPredictor) -> BenchLog:
    options = [_begun(c, log.motion.time[0]) for c in log.commands]
    trials = [replace(log, commands=(e, r)) for e in options[0] for r in options[1]]
    if len(trials) == 1:
        return log
    end = log.motion.time[0] + EARLY
    early = log.motion.time[log.keep["piston/F"]] < end

    def cost(trial: BenchLog) -> float:
        r = standardised(trial, predictor.readings(trial, {}, {}))["piston/F"]
        return float(np.mean(np.abs(r[early])))

    return min(trials, key=cost)


def _begun(intervals: list[tuple[float, float]], start: float) -> list[list[tuple[float, float]]]:
    """The pulses as they are, and with the first one switched on when the log starts."""
    if not intervals or np.isfinite(intervals[0][0]):
        return [intervals]
    return [intervals, [(start, intervals[0][1]), *intervals[1:]]]
