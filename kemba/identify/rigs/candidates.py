"""What may be missing on a rig of the user's own, and how large it must be to matter there.

A drive of a clock and a drive of a crane have other frictions. So every force is measured against
one usual force of the rig, and every speed and travel against those of the logs.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from kemba.effects import BY_KIND
from kemba.errors import KembaError
from kemba.identify.problem.candidates import (
    CandidateSettings,
    by_default,
    effect_candidates,
    sensor_candidates,
)
from kemba.identify.problem.types import Array, Candidate, Parameter, Theta
from kemba.identify.rigs.prediction import Predictor
from kemba.identify.rigs.rig_log import ANSWER, PLACE, RigLog
from kemba.model.model import Model


def possible_candidates(model: Model, logs: Sequence[RigLog]) -> dict[str, Candidate]:
    """Effects and sensor faults by name, sized as the catalogue has them."""
    return standing_candidates(model) | sensor_candidates(_sensor_sigmas(model, logs), model)


def standing_candidates(model: Model) -> dict[str, Candidate]:
    """Effects by name that the model of the rig can have."""
    return {n: c for n, c in effect_candidates(model).items() if stands(model, n)}


def stands(model: Model, kind: str) -> bool:
    """Whether the model can have the effect: some read what is not here, such as valves."""
    try:
        _ = model.with_effects([by_default(kind)]).node
    except KembaError:
        return False
    return True


def _sensor_sigmas(model: Model, logs: Sequence[RigLog]) -> dict[str, float]:
    """Median noise of the channels whose sensors may be wrong. A drive's force is none of them: a
    scale, an offset or a lag of the motor say the same."""
    rig, found = model.mechanism.rig, {}
    for name in model.mechanism.logged:
        if name == ANSWER[rig] == "axis/tau":
            continue
        place, channels = name == PLACE[rig], [log.channels for log in logs]
        sigmas = [c.q_sigma if place else c.sigma[name] for c in channels]
        found[name] = float(np.median(sigmas))
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
PERIODS = 300  # periods that are tried for a cogging force


def usual_force(predictor: Predictor, logs: Iterable[RigLog]) -> float:
    """A friction [N or N.m] that is neither small nor large on this rig."""
    bore = predictor.model.mechanism.bore
    if bore is not None:
        return SEAL * bore.bore
    forces = [np.abs(log.channels.others[predictor.answer]) for log in logs]
    return DRIVE * float(np.percentile(np.concatenate(forces), LARGE))


def sized(
    predictor: Predictor, logs: tuple[RigLog, ...], candidates: Mapping[str, Candidate]
) -> dict[str, Candidate]:
    """The candidates with sizes and shapes that suit the rig; those that cannot show in these logs
    are left out."""
    usual, found = usual_force(predictor, logs), {}
    typical = _typical(predictor, logs)
    base = np.concatenate([predictor.gap(log, {}) for log in logs])
    for name, candidate in candidates.items():
        if candidate.sensor and candidate.lead.unit == "s" and _hidden(predictor, logs, candidate):
            continue
        if candidate.sensor:
            trial = _with_units(candidate, predictor)
        else:
            trial = _with_units(_shaped(candidate, typical), predictor)
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


def _shaped(candidate: Candidate, typical: Mapping[str, float]) -> Candidate:
    reach = CandidateSettings.reach
    shapes = []
    for shape in candidate.shapes:
        name = f"{candidate.effect}.{shape.name}"
        if name in typical:
            low, high = typical[name] / reach, typical[name] * reach
            shape = replace(shape, typical=typical[name], lower=low, upper=high)
        shapes.append(shape)
    return replace(candidate, shapes=tuple(shapes))


def _with_units(candidate: Candidate, predictor: Predictor) -> Candidate:
    """Parameters in the units of a rotary axis where the axis turns."""
    if predictor.model.mechanism.logged.get("axis/q") != "rad" or candidate.sensor:
        return candidate
    declared = BY_KIND[candidate.effect].declared()

    def turned(parameter: Parameter) -> Parameter:
        return replace(parameter, unit=declared[parameter.name].rotary or parameter.unit)

    shapes = tuple(turned(shape) for shape in candidate.shapes)
    return replace(candidate, lead=turned(candidate.lead), shapes=shapes)


def _typical(predictor: Predictor, logs: tuple[RigLog, ...]) -> dict[str, float]:
    """Where the search for shapes starts, by name in theta."""
    speed = np.concatenate([np.abs(log.speed) for log in logs])
    places = np.concatenate([log.channels.q[log.channels.rows] for log in logs])
    fast, travel = float(np.percentile(speed, LARGE)), float(np.ptp(places))
    found = {
        "stribeck_friction.v_b": FADING * fast,
        "axis_stribeck.v_b": FADING * fast,
        "presliding.travel": STRETCH * travel,
        "end_cushion.L": CUSHION * travel,
    }
    if "cogging" in predictor.candidates:
        period, phase = _strongest_period(predictor, logs)
        found |= {"cogging.period": period, "cogging.phase": phase}
    return found


def _strongest_period(predictor: Predictor, logs: tuple[RigLog, ...]) -> tuple[float, float]:
    """Travel and phase of the sine of the position that explains most of the force which inertia,
    friction and an offset leave."""
    none: Theta = {}
    force = np.concatenate([-predictor.gap(log, none) for log in logs])
    q, v, a = (
        np.concatenate([getattr(log.channels, c)[log.channels.rows] for log in logs]) for c in "qva"
    )
    sure = np.concatenate([log.doubt for log in logs]) < 0.1
    if sure.sum() > 100:
        force, q, v, a = force[sure], q[sure], v[sure], a[sure]
    base = np.stack([a, v, np.abs(v), np.sign(v), np.ones(len(v))], axis=1)
    left = _residual(base, force)
    travel = float(np.ptp(q))
    finest = max(travel / 300.0, 4.0 * float(np.median(np.abs(np.diff(q)))) + 1e-12)
    best, answer = 0.0, (travel / 3.0, 1.0)
    for period in np.geomspace(min(finest, travel / 3.0), travel / 1.5, PERIODS):
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
