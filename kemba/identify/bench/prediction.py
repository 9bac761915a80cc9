"""What a bench log should read under a model, with effects on its list and sensors as they are: the
rig's chambers are driven by the imposed motion."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from kemba.effects.pneumatics.flow import ATMOSPHERE
from kemba.effects.pneumatics.switching import cut, delayed, instants, is_on
from kemba.effects.series import Series
from kemba.identify.bench.bench_log import PRESSURES, BenchLog, Pulses, SmoothedMotion
from kemba.identify.bench.clocks import commands_by_one_clock, motion_by_one_clock
from kemba.identify.problem.candidates import CompiledModels, OpenModel
from kemba.identify.problem.problem import Array, Candidate, Theta
from kemba.machine_code import SampleMap
from kemba.mechanism import Cylinder
from kemba.model.model import Model

# The velocity is known within v_sigma: the force is its mean over three Gauss-Hermite nodes
V_NODES, V_MIDDLE = ((-np.sqrt(3.0), 1 / 6), (np.sqrt(3.0), 1 / 6)), 2 / 3  # sigma, weight

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


class RigModel(OpenModel):
    """A piston on a bench: its force, and its slopes by the valves."""

    def __init__(self, model: Model, free: tuple[str, ...], scaled: tuple[str, ...]) -> None:
        super().__init__(model, free, scaled)
        node, self.state_names = self.node, tuple(q.name for q in model.states.values())
        inputs = [node.s, node.q, node.v, node.a, node.u, node.p]
        force = node.outputs["piston/F"]
        results = ca.vertcat(force, ca.jacobian(force, node.u).T)
        self._output = SampleMap(inputs, [results])

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
        p = self.parameters(values)
        seen = motion.time - late
        events = [*(instants(v) for v in valves), _substeps(seen)]
        times, at_sample = cut(seen, np.concatenate(events))
        u = np.stack([is_on(v, times) for v in valves])
        begin = self.along.rest(motion.x[0], 0.0, 0.0, u[:, 0], p)
        begin += np.array([(start or {}).get(name, 0.0) for name in self.state_names])
        middle = 0.5 * (times[:-1] + times[1:])
        along = [np.interp(middle, motion.time, c) for c in (motion.x, motion.v, motion.a)]
        driven = np.stack([np.diff(times), *along, *u[:, :-1]], axis=1)
        s = self.along.run(begin, driven, p)[0][at_sample]
        blurred = np.stack([share(v, seen) for v in valves], axis=1)
        moved = Series(motion.time, motion.x, (motion.v, motion.a)).late(late)
        x, (v0, a) = moved.value, moved.rates

        def output(v: Array) -> Array:
            """Force, and its slopes by the valves (n, 3), at a velocity (n,)."""
            return self._output([s, x[:, None], v[:, None], a[:, None], blurred], p)[0]

        out = output(v0)
        force = V_MIDDLE * out[:, 0]
        for place, weight in V_NODES:
            force += weight * output(v0 + place * motion.v_sigma)[:, 0]
        states = dict(zip(self.state_names, s.T, strict=True))
        return Prediction(force, out[:, 1:], blurred, states)


def _substeps(samples: Array) -> Array:
    """Times (m,) between samples (n,) that are farther apart than the longest step."""
    pieces = np.ceil(np.diff(samples) / STEP - 1e-6).astype(int)
    fill = [
        np.linspace(samples[i], samples[i + 1], pieces[i] + 1)[1:-1]
        for i in np.flatnonzero(pieces > 1)
    ]
    return np.concatenate([[], *fill])


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


SENT_LATE = "sent:late"  # nuisance of slow logs [s]: by how much all commands were sent later


class BenchPredictor(CompiledModels[RigModel]):
    """Rigs of one model.

    `exact`: what a late force sensor shows is computed at its own times, not read off between rows.
    """

    exact = False

    def __init__(self, model: Model, candidates: Mapping[str, Candidate]) -> None:
        super().__init__(model, candidates, RigModel)

    def predict(
        self, run: BenchLog, theta: Theta, start: Mapping[str, float] | None = None
    ) -> Prediction:
        """What happens on the rig, before any sensor; where `exact`, at the times that the force of
        a row is of. `start`: by how much states differ from rest when the log begins."""
        rig, sent, late = self.at(theta), self.sent(run, theta), self._shift(theta)
        motion, values = self.true_motion(run, theta), self.values(theta)
        return rig.predict(motion, sent.commands, values, start or {}, late)

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
    """A slow log with the variance of commands sent at any time between two rows."""
    if not log.seen_within:
        return log
    early, late = (predictor.readings(log.sent(by * log.seen_within), {}, {}) for by in (-0.5, 0.5))
    changes = {c: late[c][0] - early[c][0] for c in log.measured}
    return replace(log, by_timing={c: change**2 / 12.0 for c, change in changes.items()})


def _settled(log: BenchLog, predictor: BenchPredictor) -> BenchLog:
    begin = log.motion.time[0]
    options = [  # as they are, and with the first pulse switched on when the log starts
        [sent, [(begin, sent[0][1]), *sent[1:]]] if sent and np.isinf(sent[0][0]) else [sent]
        for sent in log.commands
    ]
    trials = [replace(log, commands=(e, r)) for e in options[0] for r in options[1]]
    if len(trials) == 1:
        return log
    end = log.motion.time[0] + EARLY
    early = log.motion.time[log.keep["piston/F"]] < end

    def cost(trial: BenchLog) -> float:
        r = standardised(trial, predictor.readings(trial, {}, {}))["piston/F"]
        return float(np.mean(np.abs(r[early])))

    return min(trials, key=cost)
