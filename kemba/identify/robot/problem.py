"""Robot logs under one model as whitened residuals: the innovations of a filter around the data."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from copy import copy

import numpy as np
from typing_extensions import Self

from kemba.identify.infer.windows import rms
from kemba.identify.logs.gate import BadData
from kemba.identify.problem.candidates import (
    FIGURES,
    FREE_THEN,
    ORIFICE,
    extended,
    free_figures,
    ground_of,
    in_the_air,
    robot_candidates,
    sensor_candidates,
    with_orifices,
)
from kemba.identify.problem.problem import Array, Candidate, Problem, Theta
from kemba.identify.problem.sensor_faults import SensorFaults, is_straight, moves_readings
from kemba.identify.robot.batch import Batch, ResampledLog, resample
from kemba.identify.robot.filter import (
    Noise,
    expected_power,
    predicted_error,
    stated_noise,
    with_drifts,
)
from kemba.identify.robot.forces import RobotForces, describe
from kemba.identify.robot.geometry import StandingLengths, remarks, standing_lengths
from kemba.identify.robot.linear import ForceDensity, first_reference
from kemba.identify.robot.mix_ups import Left, in_flight, mixed_up
from kemba.identify.robot.physics import Physics
from kemba.identify.robot.state import learnt_from, linearise_at
from kemba.identify.robot.validate import (
    contradictions,
    mixed_commands,
    slightly_mixed_up,
    turned_torques,
)
from kemba.model.model import Model
from kemba.trajectory import Trajectory

WINDOW = 20  # rows over which one-step errors are summed
PREDICTED = 0.05  # time of a prediction that tells an error in a channel's unit [s]


class RobotProblem(RobotForces):
    """`Problem` for robot logs; see the text of `kemba.identify.robot.state`.

    `state`: the logs with the model linearised along their motion. `lengths`: those at which feet
    stand, where they are not the model's; contacts are read with them. `unknown`: density of the
    forces that no model explains. `figures`: nuisance parameters of the model's chambers that are
    known less well than its nominal ones.
    """

    moves = True
    learns_colour = True

    def __init__(
        self,
        logs: Sequence[Trajectory],
        model: Model,
        figures: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        self.logs = tuple(logs)
        self.window = WINDOW  # innovations are one-step errors
        blind = any(log.meta.get("torques") is False for log in logs)
        # of hips without a logged torque N2.m2.s: 10 N.m for 0.1 s
        self.model, self.unknown = model, ForceDensity(hip=10.0) if blind else ForceDensity()
        found = robot_candidates(model)
        effects = in_the_air(found)
        grip, ground = ground_of(model)
        free = tuple(key for c in effects for key, _ in c.keys().items())
        physics = Physics(extended(model, effects), free, grip, figures)
        self.own_figures = {name: FIGURES[name] for name in figures or {}}
        self.runs = tuple(str(log.meta.get("name", i)) for i, log in enumerate(logs))
        batch = Batch(
            tuple(
                resample(log, physics.channels, physics.legs, name)
                for log, name in zip(logs, self.runs, strict=True)
            )
        )
        sigma = dict(zip(physics.channels, np.median(batch.sigma, axis=0).tolist(), strict=True))
        self.candidates: dict[str, Candidate] = {**found, **sensor_candidates(sigma, model)}
        sensors = SensorFaults(model.effects)
        reference = first_reference(physics, batch, physics.nominal)
        left = self._left(physics)
        self.standing = StandingLengths()
        slight = list(slightly_mixed_up(physics, batch.resampled, left))
        self.flights = [log.name for log in batch.resampled if in_flight(physics, log)]
        if not slight and len(self.flights) < len(logs):
            self.standing = standing_lengths(physics, batch, reference, self.candidates)
        legs = self.standing.lengths
        logs_mixed = (mixed_up(physics, log, legs, left) for log in batch.resampled)
        self.mixed = [fault for faults in logs_mixed for fault in faults] or slight
        if self.mixed:  # lengths are not fitted to a log whose zeros are in doubt
            self.standing = StandingLengths()
        self.lengths = lengths = dict(self.standing.lengths)
        given = lengths, ground, self.unknown, stated_noise(batch), None if lengths else reference
        self.state = linearise_at(physics, batch, sensors, *given)
        self.nuisance = {**physics.nuisance, **sensors.nuisance, **physics.links}

    @property
    def physics(self) -> Physics:
        """The model's functions."""
        return self.state.physics

    @property
    def batch(self) -> Batch:
        """The resampled logs side by side."""
        return self.state.batch

    def limits(self, name: str) -> tuple[float, float]:
        """Those of the physics' figures; links and sensors have their priors only."""
        if name not in self.physics.names:
            return super().limits(name)
        i = self.physics.names.index(name)
        lower, upper = self.physics.bounds
        return float(lower[i]), float(upper[i])

    def relinearise(self, base: Theta) -> Self:
        """The same problem, smoothed and linearised anew with the model at `base`."""
        found, old = copy(self), self.state
        own = any(map(moves_readings, base))
        found.base = base = base if own else {**self.lengths, **base}
        given = old.physics, old.batch, old.sensors, base, old.ground, self.unknown, old.noise
        found.state = linearise_at(*given)
        return found

    @property
    def structures(self) -> frozenset[str]:
        """Orifice chambers, where the model has others."""
        return frozenset({ORIFICE} & set(self.candidates))

    def rebuilt(self, theta: Theta) -> Self:
        """The same logs under the model with orifice chambers, their figures free."""
        # usual figures: those found beside a share of the old chambers are distorted by it
        values = {p.name: p.typical for p in self.candidates[ORIFICE].shapes}
        model = with_orifices(self.model, values)
        found = type(self)(self.logs, model, free_figures(values))
        dropped = {*FREE_THEN, *(set(robot_candidates(self.model)) - set(self.candidates))}
        left = found.candidates.items()
        found.candidates = {k: c for k, c in left if not {k, k.split(":")[0]} & dropped}
        return found

    def recolour(self, residual: Array | None, careful: bool = False) -> Self:
        """The same problem with the colour of each sensor's noise as stated, or learnt anew from a
        residual (n,)."""
        if residual is None:
            return self._with_noise(stated_noise(self.batch))
        return self._with_noise(learnt_from(self.state, residual, drifts=careful))

    def drifting(self) -> Self | None:
        """The same problem with a drift, as large as the stated noise, at every sensor that has
        none; None where all have one."""
        noise = with_drifts(self.state.noise, self.batch)
        return None if noise == self.state.noise else self._with_noise(noise)

    def log_density(self) -> float:
        """That of the innovations' whitener."""
        return float(np.log(np.diagonal(self.state.gain.whitener, 0, 2, 3)[self.state.mask]).sum())

    def with_noise_of(self, other: Problem) -> Self:
        """This problem with the noise that another one, of the same sensors, has learnt."""
        return self._with_noise(other.state.noise) if isinstance(other, RobotProblem) else self

    def _with_noise(self, noise: Noise) -> Self:
        found = copy(self)
        found.state = self.state.with_noise(noise)
        return found

    def residual(self, theta: Theta) -> Array:
        """Whitened (predicted - measured) (n,), rows as `rows` describes them."""
        return self.state.pick(self.state.residuals([theta]))[:, 0]

    def each_residual(self, thetas: Sequence[Theta]) -> Iterator[Array]:
        """The same (n,) at each theta in turn; the filter takes them side by side."""
        return self.state.each_residual(thetas)

    def jacobian(self, theta: Theta, names: Iterable[str]) -> Array:
        """Derivatives (n, k) where the force is linear in the parameter, else secants."""
        if not (names := list(names)):
            return super().jacobian(theta, names)
        direct = [n for n in names if self._is_direct(n)]
        others = [n for n in names if n not in direct]
        # the shapes of absent effects have their typical value
        typical = {k: v.typical for k, v in self.parameters().items() if np.isfinite(v.typical)}
        found = self.state.slopes({**typical, **theta}, direct)
        columns = dict(zip(direct, found, strict=True))
        if others:
            columns |= dict(zip(others, super().jacobian(theta, others).T, strict=True))
        return np.stack([columns[n] for n in names], axis=-1)

    def _is_direct(self, name: str) -> bool:
        """Whether the force is linear in it, and nothing else depends on it."""
        physics = self.physics
        if moves_readings(name) or name in physics.moving or name in physics.base.delays:
            return False
        lead = any(name == c.key for c in self.candidates.values())
        return name in self.state.linear or (
            name in physics.names and (lead or name in self.nuisance)
        )

    def is_straight(self, name: str) -> bool:
        """Whether residuals are linear in it: effects without memory, bias and scale of sensors."""
        return self._is_direct(name) or is_straight(name)

    def expected_power(self) -> Array:
        """Mean square (n,) that each row would have if the model were right."""
        power = expected_power(self.state.motion.system, self.state.gain)
        return self.state.pick(power[..., None])[:, 0]

    def window_errors(self, theta: Theta) -> dict[str, Array]:
        """Per channel, measured minus predicted (k,) in its unit, over short times that begin on
        the measured motion; contact forces are the data's."""
        state, batch = self.state, self.batch
        row = float(np.median(batch.h[batch.valid]))
        steps = max(2, round(PREDICTED / row))
        y = np.nan_to_num(state.measurement(theta))
        errors = predicted_error(state.motion.system, y, state.acceleration(theta), steps)
        return {
            channel: errors[..., i][state.mask[..., i]]
            for i, channel in enumerate(self.physics.channels)
        }

    def validate(self) -> list[str]:
        """Which lengths make the feet stand, where they are not the model's, and what cannot be
        told where none stands. Raises BadData where a log contradicts itself or any model."""
        faults = self.mixed  # columns by feet, then commands, then what no model explains
        if not faults:
            r, rows = self.residual(self.lengths), self.rows()
            faults = list(mixed_commands(self.state, rows, r, self._left(self.physics)))
            faults = faults or list(turned_torques(self.state, rows, r))
            faults = faults or list(contradictions(self.state, rows, r, self._sensor_columns))
        if faults:
            raise BadData(faults)
        zeros = (
            "wrong zeros of the height, the pitch, hips and pistons cannot be told from missing "
            "effects; a log in which the robot stands tells them"
        )
        all_fly = len(self.flights) == len(self.runs)
        return [f"no foot stands: {zeros}"] if all_fly else remarks(self.standing)

    def _left(self, physics: Physics) -> Left:
        """What the model leaves of other logs; everything of a motion that it cannot follow."""

        def left(*logs: ResampledLog) -> Array:
            batch, sensors = Batch(logs), SensorFaults(self.model.effects)
            ground, noise = ground_of(self.model)[1], stated_noise(batch)
            try:
                state = linearise_at(physics, batch, sensors, {}, ground, self.unknown, noise)
            except np.linalg.LinAlgError:  # such as one with ten times the strokes of its pistons
                return np.full(len(logs), np.inf)
            r, run = state.pick(state.residuals([{}])), describe(state).run
            return np.array([rms(r[run == i]) for i in range(len(logs))])

        return left

    def _sensor_columns(self) -> Array:
        """Columns (n, k) of every sensor fault and every length, per size."""
        faults = [c for c in self.candidates.values() if moves_readings(c.key)]
        return self.jacobian(self.lengths, [c.key for c in faults]) * [c.lead.size for c in faults]


def robot_problem(
    logs: Sequence[Trajectory], model: Model, candidates: Collection[str] | None = None
) -> RobotProblem:
    """The problem of explaining robot logs with `model` and what may be added to it."""
    problem = RobotProblem(logs, model)
    if candidates is not None:
        problem.candidates = {k: c for k, c in problem.candidates.items() if k in candidates}
    return problem
