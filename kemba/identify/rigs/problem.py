"""Logs of a cylinder with measured pressures or of a drive: the balance of forces as residuals."""

from collections.abc import Mapping, Sequence

import numpy as np
from typing_extensions import Self

from kemba.identify.problem.missing_force import missing_along
from kemba.identify.problem.noise import ColouredProblem, whiten
from kemba.identify.problem.sensor_faults import is_straight
from kemba.identify.problem.types import (
    Array,
    Flags,
    ForceChannel,
    MissingForce,
    OperatingPoint,
    Rows,
    Theta,
)
from kemba.identify.rigs.candidates import possible_candidates, sized, usual_force
from kemba.identify.rigs.prediction import Predictor
from kemba.identify.rigs.rig_log import RigLog, prepare
from kemba.model.model import Model
from kemba.trajectory import Trajectory

# prior sigma of the zero of a pressure sensor [Pa]: the pressure of the air changes by 1 kPa (1
# sigma) with the weather
WEATHER = 1e3


class RigProblem(ColouredProblem):
    """`Problem` for logs of a cylinder or a drive. One row per judged row of a log: predicted less
    measured force, over its noise. `figures`: more numbers of the model that theta may scale, with
    1 sigma of the factor."""

    def __init__(
        self, logs: Sequence[RigLog], model: Model, figures: Mapping[str, float] | None = None
    ) -> None:
        self.model, self.logs = model, tuple(logs)
        self.runs = tuple(log.name for log in self.logs)
        possible = possible_candidates(model, self.logs)
        predictor = Predictor(model, possible)
        predictor.figures |= {name: (1.0, sigma) for name, sigma in (figures or {}).items()}
        self.candidates = sized(predictor, self.logs, possible)
        self.usual = usual_force(predictor, self.logs)
        self.predictor = predictor
        predictor.candidates = self.candidates
        self.nuisance = predictor.figures | predictor.sensors.nuisance
        for name in model.mechanism.logged:
            key = f"sensor_bias:{name}"
            if name.endswith("/P") and key not in predictor.sensors.listed:
                self.nuisance[f"{key}.b"] = (0.0, WEATHER)
                self.candidates.pop(key, None)
        self._sigma = [np.sqrt(predictor.variance(log, self.usual)) for log in self.logs]

    @property
    def answer(self) -> str:
        """The channel that is predicted."""
        return self.predictor.answer

    @property
    def unit(self) -> str:
        """Unit of that channel."""
        return self.model.mechanism.logged[self.answer]

    def residual(self, theta: Theta) -> Array:
        parts = []
        for i, log in enumerate(self.logs):
            with np.errstate(over="ignore"):  # a fit may try what nothing is predicted at
                r = self.predictor.gap(log, theta) / self._sigma[i]
            parts.append(whiten(r, self.colour[i, 0]) if (i, 0) in self.colour else r)
        return np.concatenate(parts)

    def rows(self) -> Rows:
        still, parts = self.model.mechanism.sign_speed, []
        for i, log in enumerate(self.logs):
            n, v = len(log.time), log.speed
            phase = np.where(np.abs(v) < still, "rest", np.where(v > 0, "forward", "back"))
            parts.append((np.full(n, i), log.time, phase, self._sigma[i]))
        run, time, phase, sigma = (np.concatenate(p) for p in zip(*parts, strict=True))
        channel, mode = np.zeros(len(run), dtype=int), np.full(len(run), "", dtype=object)
        units = {self.answer: self.unit}
        return Rows(run, channel, time, phase, mode, (self.answer,), sigma, units)

    def coarser(self, theta: Theta) -> Self:
        """The same problem without colour, which forgets what changes slowly, and with what the
        model at theta lacks as noise of all rows alike [N or N.m], beside that of the sensors."""
        found = self.recolour(None)
        gap, plain = (
            np.concatenate([self.predictor.gap(log, at) for log in self.logs]) for at in (theta, {})
        )
        # where a direction is in doubt, all that the effects at theta do is
        usual = max(self.usual, float(np.sqrt(np.mean((gap - plain) ** 2))))
        power = [self.predictor.variance(log, usual) for log in self.logs]
        known = np.concatenate(power)
        lacks = max(float(np.average(gap**2 - known, weights=1.0 / known)), 0.0)
        found._sigma = [np.sqrt(one + lacks) for one in power]
        return found

    def is_straight(self, name: str) -> bool:
        """Whether the residual is linear in a figure."""
        return is_straight(name)

    def operating_point(self) -> OperatingPoint:
        """The piston of every row; a drive has none."""
        bore = self.model.mechanism.bore
        if bore is None:
            return OperatingPoint.nowhere(sum(len(log.time) for log in self.logs))
        place, speed, force = (np.concatenate(p) for p in zip(*self._seen(), strict=True))
        return OperatingPoint(place, speed, force, bore.stroke)

    def force_channels(self) -> list[ForceChannel]:
        """Where a force may be missing: on the rod, or on the axis."""
        sigma = np.concatenate(self._sigma)
        place, speed, force = (np.concatenate(p) for p in zip(*self._seen(), strict=True))
        slow = np.abs(speed) < self.model.mechanism.sign_speed
        unit = "m" if self.model.mechanism.bore else self.model.mechanism.logged["axis/q"]
        quantities = {
            f"speed [{unit}/s]": np.where(slow, np.nan, speed),
            f"position [{unit}]": place,
            f"load [{self.unit}]": force,
        }

        def columns(shapes: Array) -> Array:
            return self.whiten(np.asarray(shapes / sigma[:, None]))

        name = "rod" if self.model.mechanism.bore else "axis"
        return [ForceChannel(name, self.unit, self.usual, quantities, columns)]

    def missing_force(
        self, theta: Theta | None = None, strength: Array | None = None
    ) -> list[MissingForce]:
        """The force that is missing, per run."""
        return [
            missing_along(
                log.name,
                log.time,
                -self.predictor.gap(log, theta or {}),
                sigma**2,
                (self.answer, self.unit),
                strength,
            )
            for log, sigma in zip(self.logs, self._sigma, strict=True)
        ]

    def window_errors(self, theta: Theta) -> Mapping[str, Array]:
        """Measured less predicted force (n,)."""
        gaps = [-self.predictor.gap(log, theta) for log in self.logs]
        return {self.answer: np.concatenate(gaps)}

    def way(self) -> tuple[Array, Flags]:
        """Position (n,) of every row, and whether it moves forward (n,)."""
        place, speed, _ = (np.concatenate(p) for p in zip(*self._seen(), strict=True))
        return place, speed > 0.0

    def _seen(self) -> list[tuple[Array, Array, Array]]:
        """Position, rate and measured force (k,) of every run."""
        found = []
        for log in self.logs:
            c, rows = log.channels, log.channels.rows
            found.append((c.q[rows], c.v[rows], c.others[self.answer][rows]))
        return found


def rig_problem(
    logs: Sequence[Trajectory], model: Model, figures: Mapping[str, float] | None = None
) -> RigProblem:
    """The problem of explaining logs of a cylinder or a drive with `model` and its candidates."""
    return RigProblem([prepare(log, model) for log in logs], model, figures)
