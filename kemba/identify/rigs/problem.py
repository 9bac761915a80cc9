"""Logs of a cylinder with measured pressures or of a drive: the balance of forces as residuals.

What may be missing is sized by the logs: a drive of a clock and a drive of a crane have other
frictions. So every force is measured against one usual force of the rig, and every speed and travel
against those of the logs.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from typing_extensions import Self

from kemba.effects import BY_KIND
from kemba.effects.rigs.axis import DriveAxis
from kemba.errors import KembaError
from kemba.identify.logs.gate import BadData
from kemba.identify.problem.candidates import (
    CandidateSettings,
    by_default,
    effect_candidates,
    sensor_candidates,
)
from kemba.identify.problem.missing_force import missing_along
from kemba.identify.problem.noise import ColouredProblem, whiten
from kemba.identify.problem.problem import (
    Array,
    Candidate,
    Flags,
    ForceChannel,
    MissingForce,
    OperatingPoint,
    Parameter,
    Rows,
    Theta,
)
from kemba.identify.rigs.prediction import Predictor
from kemba.identify.rigs.rig_log import ANSWER, PLACE, RigLog, prepare
from kemba.identify.rigs.validate import contradictions
from kemba.model.model import Model
from kemba.trajectory import Trajectory


def standing_candidates(model: Model) -> dict[str, Candidate]:
    """Effects by name that the model can have: some read what is not here, such as valves."""
    found = effect_candidates(model)
    for kind in tuple(found):
        try:
            _ = model.with_effects([by_default(kind)]).node
        except KembaError:
            del found[kind]
    return found


def _sensor_sigmas(model: Model, logs: Sequence[RigLog]) -> dict[str, float]:
    """Median noise of channels that may be wrong, of an axis that turns no less than its zero is
    set to; a drive's force says what its motor does."""
    rig, found = model.mechanism.rig, {}
    for name in model.mechanism.logged:
        if name == ANSWER[rig] == "axis/tau":
            continue
        place = name == PLACE[rig]
        sigmas = [log.q_sigma if place else log.sigma[name] for log in logs]
        turns = place and model.mechanism.logged[name] == "rad"
        found[name] = max(float(np.median(sigmas)), ZERO if turns else 0.0)
    return found


# What matters on a rig of the user's own.
# usual friction of a cylinder over its bore [N.m-1]: cylinders of 25 mm break away at about 0.1
# bar, which is 5 N
SEAL = 200.0
DRIVE = 0.05  # usual friction of a drive over its largest force
LARGE = 95.0  # percentile of the rows that counts as the largest [%]
FADING = 0.2  # rate at which a Stribeck friction fades, over the largest rate
STRETCH = 1e-3  # travel until contacts slide, over the whole travel
CUSHION = 0.1  # length of a cushion, over the whole travel
ZERO = 0.005  # 1 sigma to which the zero of an axis is set by hand [rad]: a third of a degree
ANY = (0.0, np.inf)  # a shape without limits of its own
PERIODS = 300  # periods that are tried for a cogging force


def usual_force(predictor: Predictor, logs: Iterable[RigLog]) -> float:
    """A friction [N or N.m] that is neither small nor large on this rig."""
    bore = predictor.model.mechanism.bore
    if bore is not None:
        return SEAL * bore.bore
    forces = [np.abs(log.others[predictor.answer]) for log in logs]
    return DRIVE * float(np.percentile(np.concatenate(forces), LARGE))


def sized(
    predictor: Predictor, logs: tuple[RigLog, ...], candidates: Mapping[str, Candidate]
) -> dict[str, Candidate]:
    """The candidates with sizes and shapes that suit the rig; those that cannot show in these logs
    are left out."""
    usual, found = usual_force(predictor, logs), {}
    limits = _limits(predictor, logs)
    typical = _typical(predictor, logs, limits)
    base = np.concatenate([predictor.gap(log, {}) for log in logs])
    for name, candidate in candidates.items():
        if candidate.sensor and candidate.lead.unit == "s" and _hidden(predictor, logs, candidate):
            continue
        trial = candidate if candidate.sensor else _shaped(candidate, typical, predictor, limits)
        theta = trial.typical()
        change = np.concatenate([predictor.gap(log, theta) for log in logs]) - base
        reach = float(np.percentile(np.abs(change), LARGE))
        if not np.isfinite(reach) or reach < 1e-9 * usual:
            continue
        scalable = not candidate.sensor and trial.lead.off == 0.0 and trial.lead.unit != "s"
        if scalable:
            lead = replace(trial.lead, size=trial.lead.size * usual / reach)
            trial = replace(trial, lead=lead)
        found[name] = trial
    return found


def _hidden(predictor: Predictor, logs: tuple[RigLog, ...], candidate: Candidate) -> bool:
    """Whether a delay looks like seals that stretch: the rod moves less meanwhile than they do."""
    stretch = predictor.model.parameters.get("measured_chambers.travel")
    if stretch is None:
        return False
    speed = np.concatenate([np.abs(log.speed) for log in logs])
    fast = float(np.percentile(speed, LARGE))
    return fast * candidate.lead.size < stretch[1]


def _shaped(
    candidate: Candidate,
    typical: Mapping[str, float],
    predictor: Predictor,
    limits: Mapping[str, tuple[float, float]],
) -> Candidate:
    """A candidate with these typical shapes within `limits`, in the units of a rotary axis where it
    turns."""
    reach, declared = CandidateSettings.reach, BY_KIND[candidate.effect].declared()
    turns = predictor.model.mechanism.logged.get("axis/q") == "rad"

    def fitting(p: Parameter) -> Parameter:
        param, name = declared[p.name], f"{candidate.effect}.{p.name}"
        unit = (turns and param.rotary) or p.unit
        if name not in typical:
            return replace(p, unit=unit)
        least, most = limits.get(name, ANY)
        lower = max(typical[name] / reach, param.lower, least)
        upper = min(typical[name] * reach, param.upper, most)
        return replace(p, unit=unit, typical=typical[name], lower=lower, upper=upper)

    shapes = tuple(map(fitting, candidate.shapes))
    return replace(candidate, lead=fitting(candidate.lead), shapes=shapes)


def _limits(predictor: Predictor, logs: tuple[RigLog, ...]) -> dict[str, tuple[float, float]]:
    """Least and largest shapes that can show: no travel below a step of the encoder, and no cogging
    of one period a turn where a weight hangs, which needs such a force by itself."""
    found = {"presliding.travel": (max(log.step for log in logs), np.inf)}
    axes = (e for e in predictor.model.effects if isinstance(e, DriveAxis))
    if any(axis.hangs and axis.m > 0.0 for axis in axes):
        found["cogging.period"] = (0.0, np.pi)
    return found


def _typical(
    predictor: Predictor, logs: tuple[RigLog, ...], limits: Mapping[str, tuple[float, float]]
) -> dict[str, float]:
    """Where the search for shapes starts, by name in theta."""
    speed = np.concatenate([np.abs(log.speed) for log in logs])
    places = np.concatenate([log.q[log.rows] for log in logs])
    fast, travel = float(np.percentile(speed, LARGE)), float(np.ptp(places))
    found = {
        "stribeck_friction.v_b": FADING * fast,
        "axis_stribeck.v_b": FADING * fast,
        "presliding.travel": STRETCH * travel,
        "end_cushion.L": CUSHION * travel,
    }
    if "cogging" in predictor.candidates:
        most = limits.get("cogging.period", ANY)[1]
        period, phase = _strongest_period(predictor, logs, most)
        found |= {"cogging.period": period, "cogging.phase": phase}
    return {name: float(np.clip(value, *limits.get(name, ANY))) for name, value in found.items()}


def _strongest_period(
    predictor: Predictor, logs: tuple[RigLog, ...], most: float = np.inf
) -> tuple[float, float]:
    """Travel, up to `most`, and phase of the sine that explains most beside inertia, friction,
    offset."""
    none: Theta = {}
    force = np.concatenate([-predictor.gap(log, none) for log in logs])
    q, v, a = (np.concatenate([getattr(log, c)[log.rows] for log in logs]) for c in "qva")
    sure = np.concatenate([log.doubt for log in logs]) < 0.1
    if sure.sum() > 100:
        force, q, v, a = force[sure], q[sure], v[sure], a[sure]
    base = np.stack([a, v, np.abs(v), np.sign(v), np.ones(len(v))], axis=1)
    left = _residual(base, force)
    travel = float(np.ptp(q))
    finest = max(travel / 300.0, 4.0 * float(np.median(np.abs(np.diff(q)))) + 1e-12)
    best, answer = 0.0, (travel / 3.0, 1.0)
    longest = min(travel / 1.5, most)
    for period in np.geomspace(min(finest, longest / 2.0), longest, PERIODS):
        wave = np.exp(2j * np.pi * q / period)
        power = abs(complex(np.vdot(wave, left)))
        if power > best:
            sines = np.stack([np.sin(2 * np.pi * q / period), np.cos(2 * np.pi * q / period)], 1)
            s, c = np.linalg.lstsq(sines, left, rcond=None)[0]
            best, answer = power, (float(period), float(np.arctan2(c, s) % (2 * np.pi)))
    return answer[0], float(np.clip(answer[1], 0.05, 6.2))


def _residual(columns: Array, y: Array) -> Array:
    scale = np.maximum(np.abs(columns).max(axis=0), 1e-12)
    fit = np.linalg.lstsq(columns / scale, y, rcond=None)[0]
    return np.asarray(y - columns / scale @ fit)


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
        sigmas = _sensor_sigmas(model, self.logs)
        possible = standing_candidates(model) | sensor_candidates(sigmas, model)
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

    def operating_point(self) -> OperatingPoint:
        """The piston of every row; a drive has none."""
        bore = self.model.mechanism.bore
        if bore is None:
            return OperatingPoint.nowhere(sum(len(log.time) for log in self.logs))
        return OperatingPoint(*self._seen(), bore.stroke)

    def force_channels(self) -> list[ForceChannel]:
        """Where a force may be missing: on the rod, or on the axis."""
        sigma = np.concatenate(self._sigma)
        place, speed, force = self._seen()
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
        """The force (n,) [N] that is missing, per run."""
        gaps = (-self.predictor.gap(log, theta or {}) for log in self.logs)
        channel = (self.answer, self.unit)
        return [
            missing_along(log.name, log.time, gap, sigma**2, channel, strength)
            for log, gap, sigma in zip(self.logs, gaps, self._sigma, strict=True)
        ]

    def window_errors(self, theta: Theta) -> Mapping[str, Array]:
        """Measured less predicted force (n,)."""
        gaps = [-self.predictor.gap(log, theta) for log in self.logs]
        return {self.answer: np.concatenate(gaps)}

    def validate(self) -> list[str]:
        """Raises BadData where columns must be mixed up. Of its frictions this rig may have less
        than the model, or more: they are fitted."""
        model = self.model
        kept = [effect for effect in model.effects if not effect.dissipative]
        bare = Predictor(Model(model.mechanism, kept, model.supply, model.name), {})
        faults = [
            fault
            for log, sigma in zip(self.logs, self._sigma, strict=True)
            for fault in contradictions(log, model, sigma, lambda trial: bare.gap(trial, {}))
        ]
        if faults:
            raise BadData(faults)
        return []

    def way(self) -> tuple[Array, Flags]:
        """Position (n,) of every row, and whether it moves forward (n,)."""
        place, speed, _ = self._seen()
        return place, speed > 0.0

    def _seen(self) -> tuple[Array, Array, Array]:
        """Position, rate and measured force (n,) of every row."""
        runs = [(log.q, log.v, log.others[self.answer], log.rows) for log in self.logs]
        place, speed, force = (np.concatenate([r[i][r[3]] for r in runs]) for i in range(3))
        return place, speed, force


def rig_problem(
    logs: Sequence[Trajectory], model: Model, figures: Mapping[str, float] | None = None
) -> RigProblem:
    """The problem of explaining logs of a cylinder or a drive with `model` and its candidates."""
    return RigProblem([prepare(log, model) for log in logs], model, figures)
