"""A set of bench logs and what a model predicts for each of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from kemba.identify.bench.bench_log import BenchLog
from kemba.identify.bench.motion import SmoothedMotion
from kemba.identify.bench.prediction import BenchPredictor
from kemba.identify.problem.types import Array, Theta


class StartSettings:
    """How a log begins."""

    # beginning of a log that tells whether a valve had just been switched [s]: twice the slowest
    # rise time of Table I
    early = 0.08


@dataclass(frozen=True)
class PredictedLogs:
    """Bench logs with the predictor of one model.

    `starts`: name in theta -> (index of the log, name of the state), for every state whose value at
    the start of a log is free.
    """

    logs: tuple[BenchLog, ...]
    predictor: BenchPredictor
    starts: Mapping[str, tuple[int, str]]

    @property
    def stroke(self) -> float:
        """Stroke of the cylinder [m]."""
        return self.predictor.model.mechanism.stroke

    def readings(self, theta: Theta, index: int) -> dict[str, tuple[Array, Array]]:
        """Channel of log `index` -> what should have been measured (n,) and its variance (n,), in
        the channel's unit."""
        start = {name: theta.get(key, 0.0) for key, (i, name) in self.starts.items() if i == index}
        return self.predictor.readings(self.logs[index], theta, start)

    def standardised(self, theta: Theta, index: int) -> dict[str, Array]:
        """Channel of log `index` -> (predicted - measured) / sigma of its rows, not whitened."""
        return standardised(self.logs[index], self.readings(theta, index))

    def motion(self, theta: Theta, index: int) -> SmoothedMotion:
        """The motion of log `index` without the position sensor's faults."""
        return self.predictor.true_motion(self.logs[index], theta)

    def acting(self, theta: Theta, index: int) -> Array:
        """Share of each sample's neighbourhood in which the two valves act (n, 2)."""
        return self.predictor.acting(self.logs[index], theta)


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
    end = log.motion.time[0] + StartSettings.early
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
