"""Logs of a vessel that blows down: pressure and temperature predicted from the start."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kemba.effects.series import Series
from kemba.identify.infer.refit import RefitSettings
from kemba.identify.problem.candidates import CompiledModels, OpenModel, sensor_candidates
from kemba.identify.problem.problem import Array, Problem, Rows, Theta, bounded
from kemba.identify.rigs.problem import standing_candidates
from kemba.model.model import Model
from kemba.trajectory import Trajectory

STEPS = 2000  # steps over a log


class BlowDown(OpenModel):
    """The air of a vessel that blows down."""

    def run(
        self, begin: float, end: float, start: Array, values: Mapping[str, float]
    ) -> tuple[Array, Array]:
        """Times (n,) [s] and states (n, 2), P [Pa] and T [K], from `start` (2,)."""
        still = np.zeros((STEPS, self.along.width))
        still[:, 0] = h = (end - begin) / STEPS
        states, _ = self.along.run(start, still, self.parameters(values))
        return np.asarray(begin + h * np.arange(STEPS + 1)), states


CHANNELS = ("vessel/P", "vessel/T")

# How well a vessel's readings and its start are known.
NOISE = 0.01  # noise of a reading over the range of its channel
WARMTH = 0.5  # smallest noise of a temperature [K]: IEC 60584 class 1 allows 1.5 K
FARTHEST = 3.0  # largest factor by which a figure is tried off
LATE = 0.02  # usual delay of a sensor, such as a thermometer's, over a log's length
START_PRESSURE = 0.02  # prior sigma of the pressure at the start, as a share
START_TEMPERATURE = 3.0  # prior sigma of the temperature at the start [K]


@dataclass(frozen=True)
class VesselLog:
    """Readings of one log: channel -> times (k,) [s] and values (k,); `start`: P [Pa], T [K]."""

    name: str
    readings: Mapping[str, tuple[Array, Array]]
    sigma: Mapping[str, float]
    start: tuple[float, float]

    @property
    def begin(self) -> float:
        """Time [s] of the first reading."""
        return min(float(time[0]) for time, _ in self.readings.values())

    @property
    def duration(self) -> float:
        """Time [s] from the first to the last reading."""
        return max(float(time[-1]) for time, _ in self.readings.values()) - self.begin


def prepare(log: Trajectory, ambient: float) -> VesselLog:
    """The readings of a log; a vessel without a temperature at its first row is at `ambient`."""
    known = log.meta.get("noise", {})
    readings, sigma = {}, {}
    for name in CHANNELS:
        if name in log:
            good = np.isfinite(log[name])
            readings[name] = (log.time[good], log[name][good])
            spread = NOISE * float(np.ptp(readings[name][1]))
            spread = max(spread, WARMTH) if name == "vessel/T" else spread
            sigma[name] = float(known.get(name, spread))
    first = {n: (float(t[0]), float(y[0])) for n, (t, y) in readings.items()}
    begin = min(t for t, _ in first.values())
    pressure = first["vessel/P"][1] if "vessel/P" in first else float("nan")
    warm = first.get("vessel/T", (np.inf, ambient))
    temperature = warm[1] if warm[0] == begin else ambient
    return VesselLog(str(log.meta.get("name", "log")), readings, sigma, (pressure, temperature))


class VesselProblem(Problem):
    """`Problem` for blow-downs. One row per reading; the start of every log is free.

    `figures`: more numbers of the model that theta may scale, with 1 sigma of the factor.
    """

    bends = True

    def __init__(
        self, logs: Sequence[VesselLog], model: Model, figures: Mapping[str, float] | None = None
    ) -> None:
        self.model, self.logs = model, tuple(logs)
        self.runs = tuple(log.name for log in self.logs)
        sigmas = {n: float(np.median([g.sigma[n] for g in self.logs if n in g.sigma]))
                  for n in CHANNELS if any(n in g.sigma for g in self.logs)}  # fmt: skip
        self.candidates = standing_candidates(model)
        longest = max(log.duration for log in self.logs)
        for name, fault in sensor_candidates(sigmas, model).items():
            if fault.lead.unit == "s":
                size = LATE * longest
                fault = replace(fault, lead=replace(fault.lead, size=size))
            self.candidates[name] = fault
        self.predictor = predictor = CompiledModels(model, self.candidates, BlowDown)
        predictor.figures |= {name: (1.0, sigma) for name, sigma in (figures or {}).items()}
        starts = {}
        for i, log in enumerate(self.logs):
            starts[f"start:vessel/P[{i}]"] = (0.0, START_PRESSURE * log.start[0])
            starts[f"start:vessel/T[{i}]"] = (0.0, START_TEMPERATURE)
        self.nuisance = predictor.figures | predictor.sensors.nuisance | starts

    def residual(self, theta: Theta) -> Array:
        parts = []
        for i, log in enumerate(self.logs):
            expected = self.expected(theta, i)
            parts += [
                (expected[name] - y) / log.sigma[name] for name, (_, y) in log.readings.items()
            ]
        return bounded(np.concatenate(parts), RefitSettings.absurd)

    def expected(self, theta: Theta, index: int) -> dict[str, Array]:
        """Channel -> what should have been read (k,), in its unit."""
        log, predictor, near = self.logs[index], self.predictor, (1.0 / FARTHEST, FARTHEST)
        values = predictor.values(theta)
        for name in values.keys() & predictor.figures.keys():  # beyond, nothing can be predicted
            values[name] = float(np.clip(values[name], *near))
        shift = [theta.get(f"start:{name}[{index}]", 0.0) for name in CHANNELS]
        start = np.array(log.start) * np.clip(1.0 + np.array(shift) / log.start, *near)
        end = log.begin + log.duration
        time, states = predictor.at(theta).run(log.begin, end, start, values)
        found = {}
        for name, (at, _) in log.readings.items():
            true = Series(time, states[:, CHANNELS.index(name)])
            shown = predictor.sensors.shown(theta, name, true).value
            found[name] = np.interp(at, time, shown)
        return found

    def rows(self) -> Rows:
        names = tuple(n for n in CHANNELS if any(n in g.readings for g in self.logs))
        parts = []
        for i, log in enumerate(self.logs):
            for name, (time, _) in log.readings.items():
                n = len(time)
                one = (np.full(n, i), np.full(n, names.index(name)), time)
                parts.append((*one, np.full(n, log.sigma[name])))
        run, channel, time, sigma = (np.concatenate(p) for p in zip(*parts, strict=True))
        label = np.full(len(run), "blow-down", dtype=object)
        nothing = np.full(len(run), "", dtype=object)
        units = {"vessel/P": "Pa", "vessel/T": "K"}
        return Rows(run, channel, time, label, nothing, names, sigma, units)


def vessel_problem(
    logs: Sequence[Trajectory], model: Model, figures: Mapping[str, float] | None = None
) -> VesselProblem:
    """The problem of explaining blow-downs with `model` and what may be added to it."""
    ambient = float(model.effect("vessel_chamber").value("ambient"))
    return VesselProblem([prepare(log, ambient) for log in logs], model, figures)
