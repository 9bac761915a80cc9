"""Bench logs under one model: the force predicted along the imposed motion, as residuals."""

from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property

import numpy as np
from typing_extensions import Self

from kemba.errors import KembaError
from kemba.identify.bench import clocks
from kemba.identify.bench.bench_log import BenchLog, prepare
from kemba.identify.bench.forces import (
    bench_force_channel,
    bench_missing,
    bench_operating_point,
    formula_columns,
    formula_weight,
    leftover,
    switchings,
)
from kemba.identify.bench.motion import position_noise
from kemba.identify.bench.prediction import SENT_LATE, BenchPredictor, PredictedLogs, settle_starts
from kemba.identify.bench.validate import contradictions
from kemba.identify.logs.gate import BadData
from kemba.identify.problem.candidates import effect_candidates, sensor_candidates
from kemba.identify.problem.noise import ColouredProblem, colours, whiten
from kemba.identify.problem.types import (
    Array,
    Changes,
    ForceChannel,
    Leftover,
    MissingForce,
    OperatingPoint,
    Rows,
    Theta,
)
from kemba.model.model import Model
from kemba.trajectory import Trajectory

# prior sigma of the bias of a pressure sensor [Pa]: two atmospheres; its zero is the
# atmosphere's or that of a vacuum
PRESSURE_ZERO = 2e5
# prior sigma of the scale error of a pressure sensor: nominal figures are off by 1 to 3 %
PRESSURE_GAIN = 0.02
STEP = 0.1  # step of finite differences of a start, as a share of the state's scale
REST = 2e-3  # speed below which the piston rests [m.s-1]


class BenchProblem(ColouredProblem):
    """Residuals of bench runs; effects join the model's list when theta switches them on.

    `drift`: whose clock gained on the others before the logs were put on one clock, and its rate.
    """

    def __init__(
        self,
        runs: Iterable[BenchLog],
        model: Model,
        sensors: bool = True,
        drift: clocks.Drift | None = None,
    ) -> None:
        logs, self.drift = tuple(runs), drift
        self.model = model
        self.runs = tuple(log.name for log in logs)
        self.candidates = effect_candidates(model)
        if sensors:
            self.candidates |= sensor_candidates(_sensor_sigmas(logs), model)
        row = max(log.seen_within for log in logs)
        hidden = {
            n: c for n, c in self.candidates.items() if c.lead.unit == "s" and c.lead.size < row
        }
        self.candidates = {n: c for n, c in self.candidates.items() if n not in hidden}
        predictor = BenchPredictor(model, self.candidates)
        states = predictor.at({}).state_names
        starts = {f"start:{name}[{i}]": (i, name) for i in range(len(logs)) for name in states}
        self.predicted = PredictedLogs(settle_starts(logs, predictor), predictor, starts)
        self.nuisance = predictor.figures | predictor.sensors.nuisance | clocks.nuisance(drift)
        if row:  # of slow logs: times within a row are not known, and not looked for
            late = [SENT_LATE, *(c.key for c in hidden.values() if c.sensor)]
            self.nuisance |= dict.fromkeys(late, (0.0, row / np.sqrt(12.0)))
        self._state_scale = {q.name: q.scale for q in model.states.values()}
        for key, (_, name) in starts.items():
            self.nuisance[key] = (0.0, self._state_scale[name])
        for channel in self.channels[1:]:
            self.nuisance[f"sensor_bias:{channel}.b"] = (0.0, PRESSURE_ZERO)
            self.nuisance[f"sensor_scale:{channel}.k"] = (0.0, PRESSURE_GAIN)

    @property
    def logs(self) -> tuple[BenchLog, ...]:
        """The prepared logs, in the order of `runs`."""
        return self.predicted.logs

    @cached_property
    def channels(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(c for log in self.logs for c in log.measured))

    def residual(self, theta: Theta) -> Array:
        """Whitened residuals (n,), run by run, then channel by channel."""
        parts = []
        for i in range(len(self.logs)):
            for channel, r in self.predicted.standardised(theta, i).items():
                colour = self.colour.get((i, self.channels.index(channel)))
                parts.append(r if colour is None else whiten(r, colour))
        return np.concatenate(parts)

    def jacobian(self, theta: Theta, names: Iterable[str]) -> Array:
        """Secants (n, k); the start of a log moves its own rows only."""
        names = list(names)
        starts = self.predicted.starts
        plain = [n for n in names if n not in starts]
        columns = dict(zip(plain, super().jacobian(theta, plain).T, strict=True))
        columns |= self._start_columns(theta, [n for n in names if n in starts])
        return np.stack([columns[n] for n in names], axis=1)

    def _start_columns(self, theta: Theta, names: list[str]) -> dict[str, Array]:
        """Columns (n,) of the initial states: one evaluation moves the starts of all runs."""
        if not names:
            return {}
        starts, share = self.predicted.starts, STEP
        at = self.rows().run
        base = self.residual(theta)
        columns: dict[str, Array] = {}
        for state in {starts[n][1] for n in names}:
            own = {n: starts[n][0] for n in names if starts[n][1] == state}
            step = {n: theta.get(n, 0.0) + share * self._state_scale[state] for n in own}
            change = self.residual({**theta, **step}) - base
            slope = change / (share * self._state_scale[state])
            columns |= {n: np.where(at == i, slope, 0.0) for n, i in own.items()}
        return columns

    def rows(self) -> Rows:
        parts: list[tuple[np.ndarray, ...]] = []
        for i, log in enumerate(self.logs):
            for c in log.measured:
                keep = log.keep[c]
                n, k = int(keep.sum()), self.channels.index(c)
                label = np.where(np.abs(log.motion.v[keep]) < REST, "rest", "moving")
                one = (np.full(n, i), np.full(n, k), log.motion.time[keep], label, log.mode[keep])
                parts.append((*one, np.full(n, log.sigma[c])))
        run, channel, time, phase, mode, sigma = (
            np.concatenate(p) for p in zip(*parts, strict=True)
        )
        return Rows(run, channel, time, phase, mode, self.channels, sigma)

    def operating_point(self) -> OperatingPoint:
        """The piston at every row."""
        return bench_operating_point(self.predicted, self.model.mechanism.stroke)

    def commands(self) -> Sequence[Changes]:
        """Per run: valve -> instants and signs of its switchings."""
        return [switchings(log) for log in self.logs]

    def force_channels(self) -> list[ForceChannel]:
        """Where a force may be missing: on the rod."""
        return [bench_force_channel(self.predicted, self.rows(), self.operating_point())]

    def missing_force(
        self, theta: Theta | None = None, strength: Array | None = None
    ) -> list[MissingForce]:
        """The force that is missing on the rod; `strength` (1,): its 1 sigma [N]."""
        return bench_missing(self.predicted, theta or {}, strength)

    def formulas(self, theta: Theta) -> Mapping[str, Array]:
        """Simple force terms of position, speed and valves: formula -> column (n,).

        None of slow logs: what a valve does between two rows looks like any formula.
        """
        if any(log.seen_within for log in self.logs):
            return {}
        names, columns = formula_columns(self.predicted, theta)
        return dict(zip(names, self.whiten(columns).T, strict=True))

    def weight(self, theta: Theta, formula: str) -> float:
        """Largest force of a formula per unit of its coefficient, as a share of a usual
        friction."""
        return formula_weight(self.predicted, theta, formula)

    def leftover(self, theta: Theta) -> Leftover:
        """Force residual, and what a force could depend on."""
        return leftover(self.predicted, theta, self.candidates)

    def drifting(self) -> Self | None:
        """The same problem with sensors that may also drift, by as much as their stated noise."""
        if self.left is None or any(c.drift for c in self.colour.values()):
            return None
        found = copy(self)
        found.colour = colours(self.rows(), self.left, careful=True, drifts=True)
        return found

    def log_density(self) -> float:
        """That of the colours."""
        return sum(colour.log_density for colour in self.colour.values())

    def in_detail(self) -> Self:
        """The same problem with nothing read off between rows."""
        found, predictor = copy(self), copy(self.predicted.predictor)
        predictor.exact = True
        found.predicted = replace(self.predicted, predictor=predictor)
        return found

    def validate(self) -> list[str]:
        """A remark on clocks that drift apart. Raises BadData where columns must be mixed up."""
        if self.contradictions:
            raise BadData(self.contradictions)
        if self.drift is None:
            return []
        return [clocks.said(*self.drift, max(float(np.ptp(g.motion.time)) for g in self.logs))]

    @cached_property
    def contradictions(self) -> list[KembaError]:
        """What must be wrong with the columns of the logs."""
        predictor = self.predicted.predictor
        return [
            fault
            for log in self.logs
            for fault in contradictions(
                log, self.model.mechanism.stroke, lambda trial: predictor.predict(trial, {}).force
            )
        ]


def bench_problem(logs: Sequence[Trajectory], model: Model) -> BenchProblem:
    """The problem of explaining bench logs with `model` and what may be added to it; logs whose
    clocks drift apart are put on one clock."""
    noise = position_noise([(log.time, log["piston/x"]) for log in logs])

    def runs(some: Sequence[Trajectory]) -> list[BenchLog]:
        names = [str(log.meta.get("name", i)) for i, log in enumerate(some)]
        return [prepare(name, log, noise) for name, log in zip(names, some, strict=True)]

    problem = BenchProblem(runs(logs), model)
    if problem.contradictions:
        return problem
    few = clocks.looked_at(logs)
    short = sum(map(len, few)) < sum(map(len, logs))
    searched = BenchProblem(runs(few), model) if short else problem
    drift = clocks.drift_between(searched, searched.logs)
    if drift is None:
        return problem
    return BenchProblem(
        [clocks.without_drift(run, *drift) for run in runs(logs)], model, drift=drift
    )


def _sensor_sigmas(logs: Sequence[BenchLog]) -> dict[str, float]:
    """Noise (1 sigma) of the force [N] and of the position [m], the median over the logs."""
    force = float(np.median([log.sigma["piston/F"] for log in logs]))
    position = float(np.median([log.motion.x_sigma for log in logs]))
    return {"piston/F": force, "piston/x": position}
