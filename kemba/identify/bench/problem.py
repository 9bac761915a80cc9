"""Bench logs under one model: the force predicted along the imposed motion, as residuals."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from functools import cached_property

import numpy as np

from kemba.effects.base import Effect
from kemba.identify.bench.library import features, terms
from kemba.identify.bench.motion import Motion
from kemba.identify.bench.plant import Prediction, Rig, share
from kemba.identify.bench.plausible import contradictions
from kemba.identify.bench.pressure import absolute_pressure
from kemba.identify.bench.run import FRICTION, PRESSURES, Run
from kemba.identify.bench.surroundings import (
    Switchings,
    bench_port,
    bench_surroundings,
    switchings,
)
from kemba.identify.bench.switching import delayed
from kemba.identify.candidates import by_default, effect_candidates, sensor_candidates
from kemba.identify.checks import BadData
from kemba.identify.laws import Port
from kemba.identify.linear import within
from kemba.identify.noise import Colour, learn, whiten
from kemba.identify.problem import Array, Rows, Theta, secant_jacobian
from kemba.identify.rank import FLOOR
from kemba.identify.surroundings import Surroundings
from kemba.model.model import Model

EARLY = 0.08  # s that tell whether a valve had just been switched when a log begins
REMEASURED = 0.1  # what an earlier discovery put on the model's list is known less well
PEAK = 99.5  # per cent of the rows below which a force counts as its largest
JITTER = 0.02  # nominal figures are off by 1-3 %


class BenchProblem:
    """Residuals of bench runs; effects join the model's list when theta switches them on."""

    def __init__(self, runs: Iterable[Run], model: Model, sensors: bool = True) -> None:
        self._runs = list(runs)
        self.model = model
        self.runs = tuple(run.name for run in self._runs)
        self.candidates = effect_candidates(model)
        if sensors:
            self.candidates |= sensor_candidates(self._sensor_sigmas())
        self._scaled = _scaled(model)
        self.nuisance = {
            name: (1.0, REMEASURED if _found(model, name) else JITTER) for name in self._scaled
        }
        self._rigs: dict[tuple[str, ...], Rig] = {}
        self._starts = {
            f"start:{name}[{i}]": (i, name)
            for i in range(len(self._runs))
            for name in self._rig(()).state_names
        }
        for key, (_, name) in self._starts.items():
            self.nuisance[key] = (0.0, self._state_scale[name])
        for channel in self.channels[1:]:
            self.nuisance[f"offset:{channel}"] = (0.0, 2e5)
            self.nuisance[f"gain:{channel}"] = (1.0, JITTER)
        self.colour: dict[tuple[int, int], Colour] = {}
        self._settle_starts()

    @property
    def logs(self) -> tuple[Run, ...]:
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

    # -- prediction -------------------------------------------------------------------------

    def _rig(self, active: tuple[str, ...]) -> Rig:
        """The model with these effects on its list, compiled once."""
        if active not in self._rigs:
            extra = [by_default(self.candidates[name].effect) for name in active]
            model = self.model.with_effects(_unlike(self.model, extra))
            keys = (key for name in active for key in tuple(self.candidates[name].keys()))
            free = tuple(key for key in keys if key in model.parameters)
            self._rigs[active] = Rig(model, free, self._scaled)
        return self._rigs[active]

    def _active(self, theta: Theta) -> tuple[str, ...]:
        return tuple(
            name
            for name, c in sorted(self.candidates.items())
            if not c.sensor and theta.get(c.key, c.lead.off) != c.lead.off
        )

    def predict(self, theta: Theta, index: int) -> dict[str, tuple[Array, Array]]:
        """Per channel of run `index`: what should have been measured, and its variance."""
        run = self._runs[index]
        rig = self._rig(self._active(theta))
        values = {name: theta.get(name, self.nuisance.get(name, (0.0,))[0]) for name in rig.names}
        start = {name: theta.get(key, 0.0) for key, (i, name) in self._starts.items() if i == index}
        motion = _true_motion(run.motion, theta)
        p = rig.predict(motion, run.commands, values, start)
        out = {"piston/F": _force(p, run, theta)}
        for channel in PRESSURES:
            if channel in run.measured:
                out[channel] = self._pressure(channel, p, run, theta)
        return out

    def _pressure(self, channel: str, p: Prediction, run: Run, theta: Theta) -> tuple[Array, Array]:
        value = absolute_pressure(channel, p.states)
        gain, offset = theta.get(f"gain:{channel}", 1.0), theta.get(f"offset:{channel}", 0.0)
        return gain * value + offset, np.full(len(value), run.sigma[channel] ** 2)

    # -- the contract -----------------------------------------------------------------------

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

    def surroundings(self) -> Surroundings:
        """The piston at every row."""
        return bench_surroundings(self)

    def commands(self) -> list[Switchings]:
        """Per run: valve -> instants and signs of its switchings."""
        return [switchings(run) for run in self._runs]

    def ports(self) -> list[Port]:
        """Where a force may be missing: on the rod."""
        return [bench_port(self)]

    def library(self, theta: Theta) -> Mapping[str, Array]:
        """Columns per unit of the coefficient, of simple terms beyond the catalogue."""
        parts: dict[str, list[Array]] = {}
        for i, run in enumerate(self._runs):
            predicted = self.predict(theta, i)
            found = dict(terms(_true_motion(run.motion, theta), self._acting(theta, i)))
            for channel, (_, variance) in predicted.items():
                keep = run.keep[channel]
                for formula, force in found.items():
                    column = force if channel == "piston/F" else np.zeros(len(force))
                    parts.setdefault(formula, []).append((column / np.sqrt(variance))[keep])
        columns = np.stack([np.concatenate(p) for p in parts.values()], axis=1)
        return dict(zip(parts, self.whiten(columns).T, strict=True))

    def weight(self, theta: Theta, formula: str, coefficient: float) -> float:
        """Largest force of a term of the library as a share of what matters in practice."""
        peaks = []
        for i, run in enumerate(self._runs):
            found = dict(terms(_true_motion(run.motion, theta), self._acting(theta, i)))
            peaks.append(np.percentile(np.abs(found[formula]), PEAK))
        return abs(coefficient) * float(max(peaks)) / FRICTION

    def leftover(self, theta: Theta) -> tuple[Array, Array, Array]:
        """Force residual over its noise and over what every model leaves (n,), what it may depend
        on (n, m), and run (n,)."""
        parts = []
        for i, run in enumerate(self._runs):
            keep = run.keep["piston/F"]
            r = self.standardised(theta, i)["piston/F"] / self._imperfect[i]
            seen = features(_true_motion(run.motion, theta), self._acting(theta, i))[keep]
            parts.append((r, seen, np.full(len(r), i)))
        residual, columns, index = (np.concatenate(p) for p in zip(*parts, strict=True))
        return residual, columns, index

    @cached_property
    def _imperfect(self) -> list[Array]:
        """Per run: spread (n,) of the force residual, in noise units, when every effect of the
        catalogue may be there at floor level."""
        found = []
        for i in range(len(self._runs)):
            base = self.standardised({}, i)["piston/F"]
            power = np.ones(len(base))
            for c in self.candidates.values():
                small = {c.key: c.lead.off + FLOOR * c.lead.size}
                there = self.standardised(within(self, small), i)["piston/F"]
                power += (there - base) ** 2
            found.append(np.sqrt(power))
        return found

    def _acting(self, theta: Theta, index: int) -> Array:
        """Share of each sample's neighbourhood in which the valves act (n, 2)."""
        run, rig = self._runs[index], self._rig(self._active(theta))
        delays = rig.timing(theta)
        return np.stack(
            [share(delayed(c, *delays), run.motion.time) for c in run.commands],
            axis=1,
        )

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
        rig = self._rig(())
        values = {name: self.nuisance[name][0] for name in rig.names}
        faults = [
            fault
            for run in self._runs
            for fault in contradictions(
                run, lambda r: rig.predict(r.motion, r.commands, values).force
            )
        ]
        if faults:
            raise BadData(faults)
        return []

    # -- how the logs begin -----------------------------------------------------------------

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


def _scaled(model: Model) -> tuple[str, ...]:
    """Nominal numbers that a rig of the same make may have a little different."""
    known = {
        "chamber": ("F_extend", "F_retract", "fill[0]", "fill[1]", "vent[0]", "vent[1]"),
        "mode_damping": ("c_extend", "c_retract", "c_both", "c_none"),
        "orifice_chamber": ("gauge", "a_fill", "a_vent", "V_e", "V_r"),
    }
    names = []
    for effect in model.effects:
        if effect.kind in known:
            names += [f"{effect.name}.{f}" for f in known[effect.kind]]
        elif effect.off and all(p.unit != "s" for p in effect.parameters().values()):
            names += [f"{effect.name}.{f}" for f in effect.off]
    return tuple(names)


def _found(model: Model, name: str) -> bool:
    """Whether a number belongs to an effect that the plain machine would not have."""
    return bool(model.effect(name.rsplit(".", 1)[0]).off)


def _unlike(model: Model, extra: list[Effect]) -> list[Effect]:
    """Effects not on the model's list already; those that are stay as they are."""
    names = {e.name for e in model.effects}
    return [e for e in extra if e.name not in names]


def _true_motion(motion: Motion, theta: Theta) -> Motion:
    """The motion that made the position sensor say what it said."""
    k = theta.get("sensor_scale:piston/x.k", 0.0)
    b = theta.get("sensor_bias:piston/x.b", 0.0)
    dt = theta.get("sensor_delay:piston/x.dt", 0.0)
    if k == b == dt == 0.0:
        return motion
    later = motion.time + dt
    x, v, a = (np.interp(later, motion.time, c) for c in (motion.x, motion.v, motion.a))
    return replace(motion, x=(x - b) / (1 + k), v=v / (1 + k), a=a / (1 + k))


def _force(p: Prediction, run: Run, theta: Theta) -> tuple[Array, Array]:
    """The transducer's reading and its variance: sensor, velocity error, switching instants."""
    force, valve = p.force, p.valve
    dt = theta.get("sensor_delay:piston/F.dt", 0.0)
    if dt:
        earlier = run.motion.time - dt
        force = np.interp(earlier, run.motion.time, force)
        valve = np.stack([np.interp(earlier, run.motion.time, c) for c in valve.T], axis=1)
    force = (1 + theta.get("sensor_scale:piston/F.k", 0.0)) * force
    force = force + theta.get("sensor_bias:piston/F.b", 0.0)
    variance = run.sigma["piston/F"] ** 2 + run.blunt**2
    variance = variance + np.sum(p.by_valve**2 * valve * (1 - valve), axis=1)
    return force, variance
