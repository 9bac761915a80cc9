"""Robot logs under one model as whitened residuals: the innovations of a filter around the data.

The measured motion is smoothed into a reference along which the model is linearised. A model that
is right explains the way from node to node; what it gets wrong is a force defect, which the filter
turns into innovations, white and of unit variance where model and noise are right. Initial states
are free, contact and stop forces unknown where the data show contact, impacts included.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from kemba.effects import BY_KIND
from kemba.identify.candidates import effect_candidates, sensor_candidates
from kemba.identify.problem import Candidate, Parameter, Rows, Theta
from kemba.identify.robot.batch import Batch
from kemba.identify.robot.filter import gains, innovations
from kemba.identify.robot.linear import Linearised, linearise, smoothed
from kemba.identify.robot.physics import Physics
from kemba.identify.robot.reference import (
    LOOSE,
    Floor,
    Reference,
    air_states,
    densities,
    first_reference,
    schedules,
)
from kemba.identify.robot.track import read_track
from kemba.model.model import Model
from kemba.trajectory import Trajectory

Array = np.ndarray[Any, np.dtype[np.float64]]

ROUNDS = 2
LEAD_IN = 4  # nodes whose innovations only tell where the run starts
LAGS = {"hose_lag.T": 1e-4, "motor_lag.T": 1e-4}
DELAYS = ("valve_delay.dt", "valve_close_delay.dt")
GROUND = ("ground_compliance", "ground_friction", "contact")


class RobotProblem:
    """`Problem` for robot logs; see the module's text."""

    def __init__(
        self, logs: Sequence[Trajectory], model: Model, candidates: Collection[str] | None = None,
        floor: Floor | None = None, base: Theta | None = None,
    ) -> None:
        self.model = model
        found = robot_candidates(model)
        effects = [c for c in found.values() if c.effect in BY_KIND and c.effect not in GROUND]
        rest = [e for e in model.effects if e.kind not in GROUND]
        extended = Model(model.mechanism, rest, model.supply, model.name).with_effects(
            BY_KIND[c.effect]() for c in effects
        )
        grip = [e.mu for e in model.effects if e.kind in GROUND]  # type: ignore[attr-defined]
        free = tuple(k for c in effects for k in c.keys())
        self.physics = Physics(extended, free, float(np.prod(grip)))
        self.nuisance = dict(self.physics.nuisance)
        self.floor = floor or Floor()
        channels = self.physics.channels
        self.batch = Batch(
            tuple(
                read_track(log, channels, self.physics.legs, str(log.meta.get("name", i)))
                for i, log in enumerate(logs)
            )
        )
        self.runs = tuple(t.name for t in self.batch.tracks)
        sigma = dict(zip(channels, np.median(self.batch.sigma, axis=0), strict=True))
        found |= sensor_candidates(sigma)
        self.candidates = {
            k: c for k, c in found.items() if candidates is None or k in candidates
        }
        self.relinearise(base or {})

    def relinearise(self, base: Theta) -> None:
        """Smooth and linearise anew with the model at `base`."""
        self.base = dict(base)
        self._kept: tuple[Any, Any] = (None, None)
        self._linear: dict[str, tuple[Array, float]] = {}
        physics, batch = self.physics, self.batch
        ref = first_reference(physics, batch)
        self.plan = schedules(physics, batch, ref)
        loose = densities(physics, batch, self.plan, LOOSE)
        for _ in range(ROUNDS):
            point = self._linearise(ref, loose)
            ref = smoothed(point, self._measurement(point, base), self._push(point, base))
        tight = densities(physics, batch, self.plan, self.floor)
        self.point = self._linearise(ref, tight)
        names, columns = self.physics.masses, self.point.masses
        self.nuisance |= dict.fromkeys(names, (0.0, 0.02))
        self._linear = {n: (columns[..., i], 0.0) for i, n in enumerate(names)}
        self._linear["ground_friction.mu"] = (self.point.less_grip, 1.0)
        self.gain = gains(self.point.system)
        self._mask = self._keep()

    def _linearise(self, ref: Reference, density: Array) -> Linearised:
        p, delays = self._values(self.base)
        states = air_states(self.physics, self.batch, ref, p, delays)
        return linearise(self.physics, self.batch, self.plan, ref, density, states, p)

    def _values(self, theta: Theta) -> tuple[Array, Array]:
        """Free parameters and delays per valve (on, off) at theta."""
        p = np.array([theta.get(n, v) for n, v in zip(self.physics.names, self.physics.nominal, strict=True)])
        for i, name in enumerate(self.physics.names):
            if name in LAGS and p[i] <= LAGS[name]:
                p[i] = 1e-6  # the shortest lag of the catalogue stands for none at all
        delays = []
        for leg in self.physics.legs:
            on, off = self.physics.base.timing(leg)
            on += theta.get("valve_delay.dt", 0.0)
            off += theta.get("valve_delay.dt", 0.0) + theta.get("valve_close_delay.dt", 0.0)
            delays += [(on, off)] * 2
        return p, np.array(delays)

    def _push(self, point: Linearised, theta: Theta) -> Array:
        """Acceleration defects (n, L, k) at theta."""
        p, delays = self._values(theta)
        force = point.force(self.physics, self.batch, self._states(point, p, delays), p)
        for name, (column, nominal) in self._linear.items():
            if name in theta:
                force = force + (theta[name] - nominal) * column
        return point.defect(force)

    def _states(self, point: Linearised, p: Array, delays: Array) -> tuple[Array, Array]:
        """Effect states and inputs, kept for as long as nothing that moves them changes."""
        moving = np.isin(self.physics.names, self.physics.moving)
        key = (id(point), p[moving].tobytes(), delays.tobytes())
        if self._kept[0] != key:
            self._kept = (key, air_states(self.physics, self.batch, point.ref, p, delays))
        return self._kept[1]

    def _measurement(self, point: Linearised, theta: Theta) -> Array:
        """Measured minus reference (n, L, m), the reference seen through the sensors at theta."""
        seen = self._sensed(point, theta)
        depth = point.penetration(theta.get("ground_compliance.softness", 0.0),
                                  theta.get("ground_compliance.d", 1.0))
        return np.concatenate([self.batch.y - seen, -point.places - depth], axis=2)

    def _sensed(self, point: Linearised, theta: Theta) -> Array:
        seen = point.y.copy()
        for i, channel in enumerate(self.physics.channels):
            delay = theta.get(f"sensor_delay:{channel}.dt", 0.0)
            if delay:
                for j, track in enumerate(self.batch.tracks):
                    n = len(track.time)
                    curve = CubicHermiteSpline(track.time, point.y[:n, j, i], point.rate[:n, j, i])
                    seen[:n, j, i] = curve(np.maximum(track.time - delay, track.time[0]))
            seen[..., i] *= 1.0 + theta.get(f"sensor_scale:{channel}.k", 0.0)
            seen[..., i] += theta.get(f"sensor_bias:{channel}.b", 0.0)
        return seen

    def _columns(self, thetas: Sequence[Theta]) -> Array:
        """Whitened innovations (n, L, m, c), one column per theta."""
        y = np.stack([self._measurement(self.point, t) for t in thetas], axis=-1)
        g = np.stack([self._push(self.point, t) for t in thetas], axis=-1)
        _, errors = innovations(self.point.system, self.gain, y, self.point.extend(g))
        return -(self.gain.whitener @ errors)

    def _keep(self) -> np.ndarray[Any, np.dtype[np.bool_]]:
        n, runs, m, _ = self.point.system.H.shape
        known = np.isfinite(self.point.system.R)
        known[:LEAD_IN] = False
        return known

    def residual(self, theta: Theta, runs: Collection[int] | None = None) -> Array:
        """Whitened (predicted - measured), run by run, channel by channel, in order of time."""
        return self._pick(self._columns([theta]), runs)[:, 0]

    def _pick(self, columns: Array, runs: Collection[int] | None) -> Array:
        chosen = range(len(self.runs)) if runs is None else runs
        return np.concatenate(
            [columns[:, i].swapaxes(0, 1)[self._mask[:, i].T] for i in chosen]
        )

    def jacobian(
        self, theta: Theta, names: Iterable[str], runs: Collection[int] | None = None
    ) -> Array:
        """Derivatives where the force is linear in the parameter, else secants; all columns go
        through the filter at once."""
        names = list(names)
        direct = self._direct(theta, [n for n in names if self._is_direct(n)])
        steps = {n: list(self._steps(theta, n)) for n in names if n not in direct}
        thetas = [theta] + [{**theta, **s} for group in steps.values() for s, _ in group]
        shifted = self._columns(thetas)
        columns, k = dict(direct), 1
        for name, group in steps.items():
            slopes = [(shifted[..., k + i] - shifted[..., 0]) / h for i, (_, h) in enumerate(group)]
            k += len(group)
            columns[name] = np.mean(slopes, axis=0)
        if not names:
            return np.empty((int(self._mask.sum()), 0))
        return self._pick(np.stack([columns[n] for n in names], axis=-1), runs)

    def _is_direct(self, name: str) -> bool:
        known = name in self.physics.names or name in self._linear
        return known and name not in self.physics.moving and name not in DELAYS

    def _direct(self, theta: Theta, names: Sequence[str]) -> dict[str, Array]:
        """Columns of parameters in which the force is linear."""
        if not names:
            return {}
        typical = {k: p.typical for c in self.candidates.values() for k, p in c.keys().items()
                   if p.typical == p.typical}
        p, delays = self._values({**typical, **theta})
        s, u = (self.batch.flat(a) for a in self._states(self.point, p, delays))
        slopes = self.physics.call("by_parameter", *self.point.middle, s, u, p=p)[0]
        place = {n: i for i, n in enumerate(self.physics.names)}
        forces = [
            self._linear[n][0] if n in self._linear else self.batch.deep(slopes[:, :, place[n]])
            for n in names
        ]
        g = np.stack([self.point.response(f) for f in forces], axis=-1)
        y = np.zeros((*self.point.system.R.shape, len(names)))
        _, errors = innovations(self.point.system, self.gain, y, self.point.extend(g))
        return dict(zip(names, np.moveaxis(-(self.gain.whitener @ errors), -1, 0), strict=True))

    def _steps(self, theta: Theta, name: str) -> Iterable[tuple[dict[str, float], float]]:
        from kemba.identify.problem import _steps

        return _steps(self, {k: p for c in self.candidates.values() for k, p in c.keys().items()},
                      theta, name)

    def rows(self, runs: Collection[int] | None = None) -> Rows:
        """What each row of `residual` is."""
        chosen = list(range(len(self.runs)) if runs is None else runs)
        channels = self.channels
        n, _, m = self._mask.shape
        parts: dict[str, list[Any]] = {k: [] for k in ("run", "channel", "time", "phase", "mode")}
        sigma = []
        for i in chosen:
            track, plan, mask = self.batch.tracks[i], self.plan[i], self._mask[:, i].T
            count = len(track.time)
            phase, mode = np.full(n, "", dtype=object), np.full((n, m), "", dtype=object)
            phase[:count] = plan.phase
            mode[:] = self.modes(i)[:, None] if False else self.modes(i)
            time = np.zeros(n)
            time[:count] = track.time
            parts["run"].append(np.full(mask.sum(), i))
            parts["channel"].append(np.broadcast_to(np.arange(m)[:, None], mask.shape)[mask])
            parts["time"].append(np.broadcast_to(time, mask.shape)[mask])
            parts["phase"].append(np.broadcast_to(phase, mask.shape)[mask])
            parts["mode"].append(mode.T[mask])
            spread = np.append(track.sigma, [1e-4] * 3 * len(self.physics.legs))
            sigma.append(np.broadcast_to(spread[:, None], mask.shape)[mask])
        joined = {k: np.concatenate(v) for k, v in parts.items()}
        return Rows(**joined, channels=channels, sigma=np.concatenate(sigma))

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels of the rows: the measured ones, and the places where feet stand."""
        feet = (f"{leg}/foot/{axis}" for leg in self.physics.legs for axis in "xz")
        stops = (f"{leg}/stop" for leg in self.physics.legs)
        return (*self.physics.channels, *feet, *stops)

    def modes(self, run: int) -> np.ndarray[Any, Any]:
        """Valve mode (n, m) of each row: the channel's own leg, else both legs' when alike."""
        _, u = self.point.states
        legs, n = self.physics.legs, self.batch.n
        texts = []
        for leg in legs:
            e, r = (u[:, run, self.physics.inputs.index(f"{leg}/valve/{s}")] > 0.5 for s in ("extend", "retract"))
            texts.append(np.array(["00", "01", "10", "11"], dtype=object)[2 * e.astype(int) + r])
        channels = self.channels
        modes = np.full((n, len(channels)), "", dtype=object)
        for k, channel in enumerate(channels):
            own = [t for leg, t in zip(legs, texts, strict=True) if channel.startswith(leg)]
            modes[:, k] = own[0] if own else texts[0]
        return modes

    def library(self, theta: Theta) -> Mapping[str, Array]:
        """No terms beyond the catalogue yet."""
        return {}


def robot_candidates(model: Model) -> dict[str, Candidate]:
    """The catalogue's effects for robot logs; compliance is searched as softness 1/k."""
    found = {k: c for k, c in effect_candidates(model).items() if not k.startswith("sensor_")}
    if "ground_compliance" in found:
        softness = Parameter("softness", "m.N-1", 0.0, 5e-5, 0.0, 1e-3)
        shape = Parameter("d", "s.m-1", 1.0, 0.5, 0.1, 10.0, 1.0)
        found["ground_compliance"] = Candidate("ground_compliance", softness, (shape,))
    return found


def robot_problem(
    logs: Sequence[Trajectory], model: Model, candidates: Collection[str] | None = None
) -> RobotProblem:
    """The problem of explaining robot logs with `model` and what may be added to it."""
    return RobotProblem(logs, model, candidates)
