"""Bench logs under one model: the force predicted along the imposed motion, as residuals."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import copy
from functools import cached_property

import numpy as np
from typing_extensions import Self

from kemba.effects.mechanics.piston import V_COULOMB
from kemba.effects.pneumatics.switching import changes
from kemba.errors import KembaError
from kemba.identify.bench import clocks
from kemba.identify.bench.bench_log import (
    FRICTION,
    BenchLog,
    SmoothedMotion,
    position_noise,
    prepare,
)
from kemba.identify.bench.prediction import SENT_LATE, BenchPredictor, settle_starts, standardised
from kemba.identify.bench.validate import contradictions, crossed
from kemba.identify.compare.force_profiles import rises
from kemba.identify.infer.linear import SpikeSlabSettings, within
from kemba.identify.logs.gate import BadData
from kemba.identify.problem.candidates import effect_candidates, sensor_candidates
from kemba.identify.problem.missing_force import missing_along, rod_terms
from kemba.identify.problem.noise import ColouredProblem, colours, whiten
from kemba.identify.problem.problem import (
    Array,
    Changes,
    ForceChannel,
    Labels,
    MissingForce,
    OperatingPoint,
    Rows,
    Theta,
)
from kemba.model.model import Model
from kemba.trajectory import Trajectory

MEMORIES = (0.001, 0.006, 0.02, 0.06, 0.2)  # times for which a switching is remembered [s]
CREEPS = (0.002, 0.006, 0.015)  # travel over which a hysteresis turns round [m]
SPEED = 0.3  # speed by which speeds are scaled [m.s-1]


def terms(motion: SmoothedMotion, u: Array, stroke: float) -> Iterator[tuple[str, Array]]:
    """(formula, force per unit coefficient (n,)); `u` (n, 2): share of each valve being on;
    `stroke` [m]."""
    x, v, (u_e, u_r) = motion.x, motion.v, u.T
    sign = np.tanh(v / V_COULOMB)
    out, back = np.maximum(v, 0.0), np.minimum(v, 0.0)
    yield from rod_terms(x, v, stroke, CREEPS)
    yield f"x - {stroke / 2:g}", x - stroke / 2
    yield f"(x - {stroke / 2:g})**2", (x - stroke / 2) ** 2
    yield "x*u_e", x * u_e
    yield "x*u_r", x * u_r
    yield "max(v, 0)*u_e", out * u_e
    yield "max(v, 0)*u_r", out * u_r
    yield "min(v, 0)*u_e", back * u_e
    yield "min(v, 0)*u_r", back * u_r
    yield "v*x", v * x
    yield f"tanh(v/{V_COULOMB:g})*u_e", sign * u_e
    yield f"tanh(v/{V_COULOMB:g})*u_r", sign * u_r
    yield "a", motion.a
    yield "u_e", u_e
    yield "u_r", u_r


def features(motion: SmoothedMotion, u: Array, stroke: float) -> Array:
    """Quantities (n, m) that a missing force could depend on: functions of position and speed,
    times functions of how long ago each valve was on. `u` (n, 2): share of each valve being on."""
    from scipy.signal import lfilter  # it takes half a second

    step = float(np.median(np.diff(motion.time)))
    x, v = motion.x / stroke - 0.5, motion.v / SPEED
    places = [np.ones(len(x)), x, x**2, v, np.abs(v), v * x, np.tanh(motion.v / V_COULOMB)]
    histories = [np.ones(len(x)), u[:, 0] * u[:, 1]]
    for valve in u.T:
        for memory in MEMORIES:
            keep = np.exp(-step / memory)
            histories.append(lfilter([1 - keep], [1, -keep], valve, zi=[keep * valve[0]])[0])
    return np.stack([p * h for p in places for h in histories], axis=1)


FORCE = "piston/F"
# prior sigma of the bias of a pressure sensor [Pa]: two atmospheres; its zero is the
# atmosphere's or that of a vacuum
PRESSURE_ZERO = 2e5
# prior sigma of the scale error of a pressure sensor: nominal figures are off by 1 to 3 %
PRESSURE_GAIN = 0.02
STEP = 0.1  # step of finite differences of a start, as a share of the state's scale
REST = 2e-3  # speed below which the piston rests [m.s-1]
PEAK = 99.5  # percentile of the rows that is taken as the largest [%]


class BenchProblem(ColouredProblem):
    """Residuals of bench runs; effects join the model's list when theta switches them on.

    `logs`: the prepared ones, in the order of `runs`. `drift`: whose clock gained on the others
    before the logs were put on one clock, and its rate. `starts`: name in theta -> (index of the
    log, name of the state), for every state whose value at the start of a log is free.
    """

    def __init__(
        self, runs: Iterable[BenchLog], model: Model, drift: clocks.Drift | None = None
    ) -> None:
        logs, self.drift = tuple(runs), drift
        self.model = model
        self.runs = tuple(log.name for log in logs)
        median = {"piston/F": [log.sigma["piston/F"] for log in logs],
                  "piston/x": [log.motion.x_sigma for log in logs]}  # fmt: skip
        sigmas = {channel: float(np.median(values)) for channel, values in median.items()}
        self.candidates = effect_candidates(model) | sensor_candidates(sigmas, model)
        row = max(log.seen_within for log in logs)
        hidden = {
            n: c for n, c in self.candidates.items() if c.lead.unit == "s" and c.lead.size < row
        }
        self.candidates = {n: c for n, c in self.candidates.items() if n not in hidden}
        predictor = self.predictor = BenchPredictor(model, self.candidates)
        self.logs = settle_starts(logs, predictor)
        states = predictor.at({}).state_names
        self.starts = {f"start:{name}[{i}]": (i, name) for i in range(len(logs)) for name in states}
        self.nuisance = predictor.figures | predictor.sensors.nuisance | clocks.nuisance(drift)
        if row:  # of slow logs: times within a row are not known, and not looked for
            late = [SENT_LATE, *(c.key for c in hidden.values() if c.sensor)]
            self.nuisance |= dict.fromkeys(late, (0.0, row / np.sqrt(12.0)))
        self._state_scale = {q.name: q.scale for q in model.states.values()}
        for key, (_, name) in self.starts.items():
            self.nuisance[key] = (0.0, self._state_scale[name])
        for channel in self.channels[1:]:
            self.nuisance[f"sensor_bias:{channel}.b"] = (0.0, PRESSURE_ZERO)
            self.nuisance[f"sensor_scale:{channel}.k"] = (0.0, PRESSURE_GAIN)

    @cached_property
    def channels(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(c for log in self.logs for c in log.measured))

    def readings(self, theta: Theta, index: int) -> dict[str, tuple[Array, Array]]:
        """Channel of log `index` -> what should have been measured (n,) and its variance (n,), in
        the channel's unit."""
        start = {name: theta.get(key, 0.0) for key, (i, name) in self.starts.items() if i == index}
        return self.predictor.readings(self.logs[index], theta, start)

    def standardised(self, theta: Theta, index: int) -> dict[str, Array]:
        """Channel of log `index` -> (predicted - measured) / sigma of its rows, not whitened."""
        return standardised(self.logs[index], self.readings(theta, index))

    def residual(self, theta: Theta) -> Array:
        """Whitened residuals (n,), run by run, then channel by channel."""
        parts = []
        for i in range(len(self.logs)):
            for channel, r in self.standardised(theta, i).items():
                colour = self.colour.get((i, self.channels.index(channel)))
                parts.append(r if colour is None else whiten(r, colour))
        return np.concatenate(parts)

    def jacobian(self, theta: Theta, names: Iterable[str]) -> Array:
        """Secants (n, k); the start of a log moves its own rows only."""
        names = list(names)
        plain = [n for n in names if n not in self.starts]
        columns = dict(zip(plain, super().jacobian(theta, plain).T, strict=True))
        columns |= self._start_columns(theta, [n for n in names if n in self.starts])
        return np.stack([columns[n] for n in names], axis=1)

    def _start_columns(self, theta: Theta, names: list[str]) -> dict[str, Array]:
        """Columns (n,) of the initial states: one evaluation moves the starts of all runs."""
        if not names:
            return {}
        starts, share = self.starts, STEP
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
        """The piston at every row: imposed motion, and the rod force that the model predicts."""
        parts = []
        for i, log in enumerate(self.logs):
            force, _ = self.readings({}, i)[FORCE]
            table = np.stack([log.motion.x, log.motion.v, force])
            parts += [table[:, log.keep[channel]] for channel in log.measured]
        x, v, force = np.concatenate(parts, axis=1)
        return OperatingPoint(x, v, force, self.model.mechanism.stroke)

    def commands(self) -> Sequence[Changes]:
        """Per run: valve -> instants [s] of its commands, and +1 or -1 for on and off."""
        sides = ("valve/extend", "valve/retract")
        return [dict(zip(sides, map(changes, log.commands), strict=True)) for log in self.logs]

    def force_channels(self) -> list[ForceChannel]:
        """Where a force may be missing: on the rod. It shows in the force channel, sample by
        sample."""
        rows, at = self.rows(), self.operating_point()
        force = rows.channel == self.channels.index(FORCE)
        readings = [self.readings({}, i) for i in range(len(self.logs))]
        parts = [
            np.sqrt(variance)[log.keep[channel]]
            for log, own in zip(self.logs, readings, strict=True)
            for channel, (_, variance) in own.items()
        ]
        sigma = np.concatenate(parts)

        def columns(flags: Array) -> Array:
            return np.asarray(flags * (force / sigma)[:, None])

        moving = force & (rows.phase == "moving")
        quantities = {
            "speed [m/s]": np.where(moving, at.v, np.nan),
            "position [mm]": np.where(force, 1e3 * at.x, np.nan),
            "model force [N]": np.where(force, at.force, np.nan),
        }
        after = {s: rises(self, rows, f"valve/{s}") for s in ("extend", "retract")}
        return [ForceChannel("rod", "N", FRICTION, quantities, columns, after)]

    def missing_force(
        self, theta: Theta | None = None, strength: Array | None = None
    ) -> list[MissingForce]:
        """The force that is missing on the rod; `strength` (1,): its 1 sigma [N]."""
        found = []
        for i, log in enumerate(self.logs):
            expected, variance = self.readings(theta or {}, i)[FORCE]
            keep = log.keep[FORCE]
            time, gap = log.motion.time[keep], (log.measured[FORCE] - expected)[keep]
            found.append(missing_along(log.name, time, gap, variance[keep], (FORCE, "N"), strength))
        return found

    def formulas(self, theta: Theta) -> Mapping[str, Array]:
        """Simple force terms of position, speed and valves: formula -> column (n,).

        None of slow logs: what a valve does between two rows looks like any formula.
        """
        if any(log.seen_within for log in self.logs):
            return {}
        parts: dict[str, list[Array]] = {}
        for i, log in enumerate(self.logs):
            forces = dict(terms(*self._along(theta, i)))
            for channel, (_, variance) in self.readings(theta, i).items():
                keep = log.keep[channel]
                for formula, force in forces.items():
                    column = force if channel == FORCE else np.zeros(len(force))
                    parts.setdefault(formula, []).append((column / np.sqrt(variance))[keep])
        columns = np.stack([np.concatenate(p) for p in parts.values()], axis=1)
        return dict(zip(parts, self.whiten(columns).T, strict=True))

    def _along(self, theta: Theta, index: int) -> tuple[SmoothedMotion, Array, float]:
        """Of one log: true motion, share (n, 2) of each valve acting by then, stroke [m]."""
        log, predictor = self.logs[index], self.predictor
        acting = predictor.acting(log, theta)
        return predictor.true_motion(log, theta), acting, self.model.mechanism.stroke

    def weight(self, theta: Theta, formula: str) -> float:
        """Largest force of a formula per unit of its coefficient, as a share of a usual
        friction."""
        forces = (dict(terms(*self._along(theta, i)))[formula] for i in range(len(self.logs)))
        peak = max(float(np.percentile(np.abs(force), PEAK)) for force in forces)
        return peak / FRICTION

    def leftover(self, theta: Theta) -> tuple[Array, Array, Labels]:
        """Force residual over its noise and over what every model leaves, and what it may depend
        on."""
        parts = []
        for i, log in enumerate(self.logs):
            r = self.standardised(theta, i)[FORCE] / self._imperfection(i)
            seen = features(*self._along(theta, i))
            parts.append((r, seen[log.keep[FORCE]], np.full(len(r), i)))
        residual, columns, run = (np.concatenate(p) for p in zip(*parts, strict=True))
        return residual, columns, run

    def _imperfection(self, index: int) -> Array:
        """Spread (n,), in noise units, of the force if every effect may be there a little."""
        base = self.standardised({}, index)[FORCE]
        power, spike = np.ones(len(base)), SpikeSlabSettings.spike
        for c in self.candidates.values():
            small = within(self.candidates, {c.key: c.lead.off + spike * c.lead.size})
            power += (self.standardised(small, index)[FORCE] - base) ** 2
        return np.asarray(np.sqrt(power))

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
        found = copy(self)
        found.predictor = copy(self.predictor)
        found.predictor.exact = True
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
        stroke, predictor = self.model.mechanism.stroke, self.predictor
        return [
            fault
            for log in self.logs
            for fault in contradictions(log, stroke, lambda run: predictor.predict(run, {}).force)
            or crossed(log, predictor.readings(log, {}, {}))
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
