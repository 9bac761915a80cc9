"""Bench logs under one model: the force predicted along the imposed motion, as residuals."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from functools import cached_property

import numpy as np

from kemba.identify.bench.bench_log import BenchLog
from kemba.identify.bench.beyond import formula_columns, leftover, weight
from kemba.identify.bench.operating_point import (
    Switchings,
    bench_operating_point,
    bench_port,
    switchings,
)
from kemba.identify.bench.prediction import Predictor
from kemba.identify.bench.validate import contradictions
from kemba.identify.compare.force_profiles import ForceChannel
from kemba.identify.evidence.candidates import effect_candidates, sensor_candidates
from kemba.identify.evidence.noise import Colour, learn, whiten
from kemba.identify.evidence.operating_point import OperatingPoint
from kemba.identify.evidence.problem import Array, Rows, Theta, secant_jacobian
from kemba.identify.logs.gate import BadData
from kemba.model.model import Model

EARLY = 0.08  # s that tell whether a valve had just been switched when a log begins
# 1 sigma of a pressure sensor: its zero is the atmosphere's or none's [Pa], its gain as nominal
PRESSURE_ZERO, PRESSURE_GAIN = 2e5, 0.02


class BenchProblem:
    """Residuals of bench runs; effects join the model's list when theta switches them on."""

    def __init__(self, runs: Iterable[BenchLog], model: Model, sensors: bool = True) -> None:
        self._runs = list(runs)
        self.model = model
        self.runs = tuple(run.name for run in self._runs)
        self.candidates = effect_candidates(model)
        if sensors:
            self.candidates |= sensor_candidates(self._sensor_sigmas(), model)
        self.predictor = Predictor(model, self.candidates)
        self.nuisance = self.predictor.figures | self.predictor.sensors.nuisance
        self._starts = {
            f"start:{name}[{i}]": (i, name)
            for i in range(len(self._runs))
            for name in self.predictor.rig({}).state_names
        }
        for key, (_, name) in self._starts.items():
            self.nuisance[key] = (0.0, self._state_scale[name])
        for channel in self.channels[1:]:
            self.nuisance[f"sensor_bias:{channel}.b"] = (0.0, PRESSURE_ZERO)
            self.nuisance[f"sensor_scale:{channel}.k"] = (0.0, PRESSURE_GAIN)
        self.colour: dict[tuple[int, int], Colour] = {}
        self._settle_starts()

    @property
    def logs(self) -> tuple[BenchLog, ...]:
        """The prepared logs, in the order of `runs`."""
        return tuple(self._runs)

    @cached_property
    def channels(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(c for run in self._runs for c in run.measured))

    @cached_property
    def _state_scale(self) -> dict[str, float]:
        return {q.name: q.scale for q in self.model.states.values()}

    def _sensor_sigmas(self) -> dict[str, float]:
        force = float(np.median([run.sigma["piston/F"] for run in self._runs]))
        position = float(np.median([run.motion.x_sigma for run in self._runs]))
        return {"piston/F": force, "piston/x": position}

    def predict(self, theta: Theta, index: int) -> dict[str, tuple[Array, Array]]:
        """Per channel of run `index`: what should have been measured, and its variance."""
        start = {name: theta.get(key, 0.0) for key, (i, name) in self._starts.items() if i == index}
        return self.predictor.readings(self._runs[index], theta, start)

    def residual(self, theta: Theta, runs: Collection[int] | None = None) -> Array:
        parts = []
        for i in range(len(self._runs)) if runs is None else runs:
            for channel, r in self.standardised(theta, i).items():
                colour = self.colour.get((i, self.channels.index(channel)))
                parts.append(r if colour is None else whiten(r, colour))
        return np.concatenate(parts)

    def standardised(self, theta: Theta, index: int) -> dict[str, Array]:
        """Per channel (predicted - measured) / sigma of run `index`, before whitening."""
        run = self._runs[index]
        return {
            c: ((y - run.measured[c]) / np.sqrt(variance))[run.keep[c]]
            for c, (y, variance) in self.predict(theta, index).items()
        }

    def jacobian(
        self, theta: Theta, names: Iterable[str], runs: Collection[int] | None = None
    ) -> Array:
        names = list(names)
        plain = [n for n in names if n not in self._starts]
        columns = dict(zip(plain, secant_jacobian(self, theta, plain, runs).T, strict=True))
        columns |= self._start_columns(theta, [n for n in names if n in self._starts], runs)
        return np.stack([columns[n] for n in names], axis=1)

    def _start_columns(
        self, theta: Theta, names: list[str], runs: Collection[int] | None
    ) -> dict[str, Array]:
        """Columns of the initial states: each moves its own run only."""
        if not names:
            return {}
        at = self.rows(runs).run
        base = self.residual(theta, runs)
        columns: dict[str, Array] = {}
        for state in {self._starts[n][1] for n in names}:
            own = {n: self._starts[n][0] for n in names if self._starts[n][1] == state}
            step = {n: theta.get(n, 0.0) + 0.1 * self._state_scale[state] for n in own}
            change = self.residual({**theta, **step}, runs) - base
            slope = change / (0.1 * self._state_scale[state])
            columns |= {n: np.where(at == i, slope, 0.0) for n, i in own.items()}
        return columns

    def rows(self, runs: Collection[int] | None = None) -> Rows:
        parts: list[tuple[np.ndarray, ...]] = []
        for i in range(len(self._runs)) if runs is None else runs:
            run = self._runs[i]
            for c in run.measured:
                keep = run.keep[c]
                n, k = int(keep.sum()), self.channels.index(c)
                label = np.where(np.abs(run.motion.v[keep]) < 2e-3, "rest", "moving")
                one = (np.full(n, i), np.full(n, k), run.motion.time[keep], label, run.mode[keep])
                parts.append((*one, np.full(n, run.sigma[c])))
        run_, channel, time, phase, mode, sigma = (
            np.concatenate(p) for p in zip(*parts, strict=True)
        )
        return Rows(run_, channel, time, phase, mode, self.channels, sigma)

    def operating_point(self) -> OperatingPoint:
        """The piston at every row."""
        return bench_operating_point(self)

    def commands(self) -> list[Switchings]:
        """Per run: valve -> instants and signs of its switchings."""
        return [switchings(run) for run in self._runs]

    def ports(self) -> list[ForceChannel]:
        """Where a force may be missing: on the rod."""
        return [bench_port(self)]

    def formulas(self, theta: Theta) -> Mapping[str, Array]:
        """Columns per unit of the coefficient, of simple terms beyond the catalogue."""
        return formula_columns(self, theta)

    def weight(self, theta: Theta, formula: str, coefficient: float) -> float:
        """Largest force of a formula as a share of what matters in practice."""
        return weight(self, theta, formula, coefficient)

    def leftover(self, theta: Theta) -> tuple[Array, Array, Array]:
        """What is left over, what it may depend on, and run; see `kemba.identify.bench.beyond`."""
        return leftover(self, theta)

    def recolour(self, residual: Array | None, careful: bool = False) -> None:
        """Learn each series' colour from residuals (n,) that were not whitened, or forget it."""
        self.colour = {}
        if residual is None:
            return
        rows = self.rows()
        for i in range(len(self._runs)):
            for k in np.unique(rows.channel[rows.run == i]):
                own = (rows.run == i) & (rows.channel == k)
                self.colour[i, int(k)] = learn(residual[own], careful=careful)

    def whiten(self, columns: Array) -> Array:
        """Columns (n, k) of not whitened slopes as `jacobian` would now return them."""
        rows, out = self.rows(), columns.copy()
        for (i, k), colour in self.colour.items():
            own = (rows.run == i) & (rows.channel == k)
            out[own] = whiten(columns[own], colour)
        return np.asarray(out)

    def plausible(self) -> list[str]:
        """Raise BadData when columns must be mixed up; returns remarks."""
        faults = [
            fault
            for run in self._runs
            for fault in contradictions(run, lambda r: self.predictor.predict(r, {}).force)
        ]
        if faults:
            raise BadData(faults)
        return []

    def _settle_starts(self) -> None:
        """A valve on in the first row: on for long, or just switched? The data say."""
        for i, run in enumerate(self._runs):
            options = [_begun(c, run.motion.time[0]) for c in run.commands]
            trials = [(e, r) for e in options[0] for r in options[1]]
            if len(trials) == 1:
                continue
            early = run.motion.time[run.keep["piston/F"]] < run.motion.time[0] + EARLY
            costs = []
            for trial in trials:
                self._runs[i] = replace(run, commands=trial)
                r = self.standardised({}, i)["piston/F"][early]
                costs.append(float(np.mean(np.abs(r))))
            self._runs[i] = replace(run, commands=trials[int(np.argmin(costs))])


def _begun(intervals: list[tuple[float, float]], start: float) -> list[list[tuple[float, float]]]:
    if not intervals or np.isfinite(intervals[0][0]):
        return [intervals]
    return [intervals, [(start, intervals[0][1]), *intervals[1:]]]
