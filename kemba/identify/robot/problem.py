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

from kemba.identify.compare.force_profiles import ForceChannel
from kemba.identify.evidence.candidates import sensor_candidates
from kemba.identify.evidence.operating_point import OperatingPoint
from kemba.identify.evidence.problem import Candidate, Parameter, Rows, Theta, parameter_steps
from kemba.identify.evidence.sensor_faults import SensorFaults, is_fault, is_straight
from kemba.identify.logs.gate import BadData
from kemba.identify.robot.candidates import (
    GRIP,
    SOFTNESS,
    extended,
    ground_of,
    in_the_air,
    robot_candidates,
    without_delay,
)
from kemba.identify.robot.dynamics.forces import Forces
from kemba.identify.robot.dynamics.inputs import air_states, read_inputs
from kemba.identify.robot.dynamics.linear import Linearised, linearise, smoothed
from kemba.identify.robot.dynamics.physics import Physics
from kemba.identify.robot.dynamics.reference import (
    LOOSE,
    Floor,
    Reference,
    densities,
    first_reference,
    schedules,
)
from kemba.identify.robot.dynamics.tolerance import SHARE
from kemba.identify.robot.formulas import formula_columns
from kemba.identify.robot.labels import describe
from kemba.identify.robot.motion.batch import Batch
from kemba.identify.robot.motion.contact import loaded
from kemba.identify.robot.motion.expected import expected_power, predicted_error
from kemba.identify.robot.motion.filter import gains, innovations
from kemba.identify.robot.motion.resampled import resample
from kemba.identify.robot.motion.sensing import ahead, sensed
from kemba.identify.robot.operating_point import changes, robot_operating_point
from kemba.identify.robot.ports import robot_ports
from kemba.identify.robot.validate import contradictions
from kemba.model.model import Model
from kemba.trajectory import Trajectory

Array = np.ndarray[Any, np.dtype[np.float64]]

ROUNDS = 2
LEAD_IN = 4  # nodes whose innovations only tell where the run starts


class RobotProblem:
    """`Problem` for robot logs; see the module's text.

    `base`: theta at which the motion is smoothed and the model linearised.
    """

    window = 20  # rows over which a comparison sums: innovations are one-step errors

    def __init__(
        self, logs: Sequence[Trajectory], model: Model, floor: Floor | None = None
    ) -> None:
        self.model, self.floor = model, floor or Floor()
        found = robot_candidates(model)
        effects = in_the_air(found)
        grip, self._soft = ground_of(model)
        free = tuple(key for c in effects for key, _ in c.keys().items())
        self.physics = Physics(extended(model, effects), free, grip)
        channels, legs = self.physics.channels, self.physics.legs
        names = [str(log.meta.get("name", i)) for i, log in enumerate(logs)]
        self.batch = Batch(
            tuple(
                resample(log, channels, legs, name) for log, name in zip(logs, names, strict=True)
            )
        )
        self.runs = tuple(names)
        sigma = np.median(self.batch.sigma, axis=0)
        self.candidates: dict[str, Candidate] = {
            **found,
            **sensor_candidates(dict(zip(channels, sigma.tolist(), strict=True)), model),
        }
        self.sensors = SensorFaults(model.effects)
        self.nuisance = self.physics.nuisance | self.sensors.nuisance
        self.relinearise({})
        self.nuisance |= dict.fromkeys(self.physics.masses, (0.0, SHARE))

    def relinearise(self, base: Theta) -> None:
        """Smooth and linearise anew with the model at `base`."""
        self.base = dict(base)
        self._linear: dict[str, tuple[Array, float]] = {}
        physics, batch = self.physics, self.batch
        ref = first_reference(physics, batch)
        late = np.array([self.sensors.lateness(base, c) for c in physics.channels])
        rates = ((ref.q, ref.v), (ref.v, ref.a), (ref.a, np.zeros_like(ref.a)))
        ref = Reference(*(ahead(a, rate, batch.resampled, late) for a, rate in rates))
        self.plan = schedules(physics, batch, ref)
        dt = float(np.median(batch.h[batch.valid]))
        for _ in range(ROUNDS):
            point = self._linearise(ref, densities(physics, batch, self.plan, LOOSE))
            forces = Forces(physics, batch, point)
            ref = smoothed(point, self._measurement(point, base), self._push(point, base, forces))
            if self.sensors.listed or any(map(is_fault, base)):
                self.plan = schedules(physics, batch, ref)  # as true sensors would have seen it
            normal = [point.normal[: len(s.phase), i] for i, s in enumerate(self.plan)]
            self.plan = [loaded(s, f, dt) for s, f in zip(self.plan, normal, strict=True)]
        self.point = self._linearise(ref, densities(physics, batch, self.plan, self.floor))
        self._forces = Forces(physics, batch, self.point)
        masses = zip(physics.masses, np.moveaxis(self.point.masses, -1, 0), strict=True)
        self._linear = {name: (column, 0.0) for name, column in masses}
        self._linear[GRIP] = (self.point.less_grip, 1.0)
        self.gain = gains(self.point.system)
        self._mask = np.isfinite(self.point.system.R)
        self._mask[:LEAD_IN] = False

    def _linearise(self, ref: Reference, density: Array) -> Linearised:
        p, delays = self._values(self.base)
        driven = read_inputs(self.physics, self.batch, ref, delays)
        states = air_states(self.physics, self.batch, driven, p)
        return linearise(self.physics, self.batch, self.plan, ref, density, states, p)

    def _values(self, theta: Theta) -> tuple[Array, Array]:
        """Free parameters (k,) and delays (valves, 2) to switching on and off, at theta."""
        names = zip(self.physics.names, self.physics.nominal, strict=True)
        p = np.array([without_delay(n, theta.get(n, value)) for n, value in names])
        valves = [leg for leg in self.physics.legs for _ in range(2)]
        return p, np.array([self.physics.base.timing(leg, theta) for leg in valves])

    def _push(self, point: Linearised, theta: Theta, forces: Forces | None = None) -> Array:
        """Acceleration (n, L, k) that the model at theta adds to the reference's."""
        force = (forces or self._forces).at(*self._values(theta))
        for name, (column, nominal) in self._linear.items():
            if name in theta:
                force = force + (theta[name] - nominal) * column
        return point.defect(force)

    def _measurement(self, point: Linearised, theta: Theta) -> Array:
        """Measured minus reference (n, L, m), the reference as the sensors at theta see it."""
        faults = {c: self.sensors.at(theta, c) for c in self.physics.channels}
        seen = sensed(faults, self.batch.resampled, point.y, point.way)
        soft = {**self._soft, **theta}
        depth = point.penetration(soft.get(SOFTNESS, 0.0), soft.get("ground_compliance.d", 1.0))
        return np.concatenate([self.batch.y - seen, -point.places - depth], axis=2)

    def _whitened(self, y: Array, g: Array) -> Array:
        """Predicted minus measured (n, L, m, c), whitened, of columns y and accelerations g."""
        _, errors = innovations(self.point.system, self.gain, y, self.point.extend(g))
        return -(self.gain.whitener @ errors)

    def columns(self, thetas: Sequence[Theta]) -> Array:
        """Whitened residuals (n, L, m, c) at each theta, rows that are no data included."""
        y = np.stack([self._measurement(self.point, t) for t in thetas], axis=-1)
        g = np.stack([self._push(self.point, t) for t in thetas], axis=-1)
        return self._whitened(y, g)

    def pick(self, columns: Array, runs: Collection[int] | None = None) -> Array:
        """(n, L, m, ...) -> rows: run by run, channel by channel, in the order of time."""
        chosen = range(len(self.runs)) if runs is None else runs
        return np.concatenate([columns[:, i].swapaxes(0, 1)[self._mask[:, i].T] for i in chosen])

    def residual(self, theta: Theta, runs: Collection[int] | None = None) -> Array:
        """Whitened (predicted - measured), rows as `rows` describes them."""
        return self.pick(self.columns([theta]), runs)[:, 0]

    def jacobian(
        self, theta: Theta, names: Iterable[str], runs: Collection[int] | None = None
    ) -> Array:
        """Derivatives where the force is linear in the parameter, else secants."""
        names = list(names)
        if not names:
            return np.empty((len(self.residual(theta, runs)), 0))
        columns = self._direct(theta, [n for n in names if self._is_direct(n)])
        known = self._parameters()
        steps = {n: list(parameter_steps(self, known, theta, n)) for n in names if n not in columns}
        moved = [{**theta, **step} for group in steps.values() for step, _ in group]
        shifted = self.columns([theta, *moved]) if moved else np.empty(0)
        k = 1
        for name, group in steps.items():
            slopes = [(shifted[..., k + i] - shifted[..., 0]) / h for i, (_, h) in enumerate(group)]
            columns[name] = np.mean(slopes, axis=0)
            k += len(group)
        return self.pick(np.stack([columns[n] for n in names], axis=-1), runs)

    def _is_direct(self, name: str) -> bool:
        """Whether the force is linear in it: shapes, states and delays are not."""
        if name in self.physics.moving or name in self.physics.base.delays:
            return False
        lead = any(name == c.key for c in self.candidates.values())
        return name in self._linear or (
            name in self.physics.names and (lead or name in self.nuisance)
        )

    def is_straight(self, name: str) -> bool:
        """Whether residuals are linear in it: effects without memory, bias and scale of sensors."""
        return self._is_direct(name) or is_straight(name)

    def _direct(self, theta: Theta, names: Sequence[str]) -> dict[str, Array]:
        """Columns (n, L, m) of parameters in which the force is linear."""
        if not names:
            return {}
        typical = {k: v.typical for k, v in self._parameters().items() if np.isfinite(v.typical)}
        slopes = self._forces.slopes(*self._values({**typical, **theta}))
        place = {n: i for i, n in enumerate(self.physics.names)}
        forces = [
            self._linear[n][0] if n in self._linear else self.batch.deep(slopes[:, :, place[n]])
            for n in names
        ]
        g = np.stack([self.point.response(f) for f in forces], axis=-1)
        y = np.zeros((*self.point.system.R.shape, len(names)))
        return dict(zip(names, np.moveaxis(self._whitened(y, g), -1, 0), strict=True))

    def _parameters(self) -> dict[str, Parameter]:
        return {key: p for c in self.candidates.values() for key, p in c.keys().items()}

    def rows(self, runs: Collection[int] | None = None) -> Rows:
        """What each row of `residual` is."""
        chosen = list(range(len(self.runs)) if runs is None else runs)
        inputs = self.point.states[1]
        return describe(self.physics, self.batch, self.plan, inputs, self._mask, chosen)

    def expected_power(self) -> Array:
        """Mean square (n,) that each row would have if the model were right."""
        return self.pick(expected_power(self.point.system, self.gain)[..., None])[:, 0]

    def window_errors(self, theta: Theta, length: float = 0.05) -> dict[str, Array]:
        """Per channel, measured minus predicted (k,) in its unit, over windows of `length` [s]
        that begin on the measured motion; contact forces are the data's."""
        steps = max(2, round(length / float(np.median(self.batch.h[self.batch.valid]))))
        y, g = self._measurement(self.point, theta), self._push(self.point, theta)
        g = self.point.extend(g[..., None])[..., 0]
        errors = predicted_error(self.point.system, np.nan_to_num(y), g, steps)
        return {
            channel: errors[..., i][self._mask[..., i]]
            for i, channel in enumerate(self.physics.channels)
        }

    def defects(self, theta: Theta) -> tuple[Array, Array]:
        """Measurement (n, L, m) and acceleration (n, L, k) of the model at theta, both beyond the
        reference's."""
        return self._measurement(self.point, theta), self._push(self.point, theta)

    def commands(self) -> list[dict[str, tuple[Array, Array]]]:
        """Per run: command -> times and sizes of its changes."""
        return [changes(track, self.physics.legs) for track in self.batch.resampled]

    def operating_point(self) -> OperatingPoint:
        """The piston of each row's leg."""
        return robot_operating_point(self)

    def ports(self) -> list[ForceChannel]:
        """Where a force may be missing: on rods, hips and the body."""
        return robot_ports(self)

    def plausible(self) -> list[str]:
        """Raise BadData where a log contradicts itself or any model; no remarks."""
        faults = list(contradictions(self))
        if faults:
            raise BadData(faults)
        return []

    def formulas(self, theta: Theta) -> Mapping[str, Array]:
        """Columns per unit of the coefficient, of simple terms beyond the catalogue."""
        return formula_columns(self)


def robot_problem(
    logs: Sequence[Trajectory], model: Model, candidates: Collection[str] | None = None
) -> RobotProblem:
    """The problem of explaining robot logs with `model` and what may be added to it."""
    problem = RobotProblem(logs, model)
    if candidates is not None:
        problem.candidates = {k: c for k, c in problem.candidates.items() if k in candidates}
    return problem
