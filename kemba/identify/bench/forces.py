"""Forces on the rod of a bench: what its rows saw, what is missing, terms beyond the catalogue."""

from collections.abc import Iterator, Mapping

import numpy as np

from kemba.effects.mechanics.piston import V_COULOMB
from kemba.effects.pneumatics.switching import changes
from kemba.identify.bench.bench_log import BenchLog, BenchLogSettings
from kemba.identify.bench.motion import SmoothedMotion
from kemba.identify.bench.prediction import PredictedLogs
from kemba.identify.compare.force_profiles import lags, risen
from kemba.identify.infer.linear import within
from kemba.identify.infer.spike_slab import SpikeSlabSettings
from kemba.identify.problem.missing_force import dahl, end_terms, missing_along
from kemba.identify.problem.types import (
    Array,
    Candidate,
    Changes,
    ForceChannel,
    Leftover,
    MissingForce,
    OperatingPoint,
    Rows,
    Theta,
)

FORCE = "piston/F"


def bench_missing(
    predicted: PredictedLogs, theta: Theta, strength: Array | None = None
) -> list[MissingForce]:
    """d(t) [N] per run: the force on the rod, with its band; `strength` (1,) [N], learnt when not
    given."""
    found = []
    for i, log in enumerate(predicted.logs):
        expected, variance = predicted.readings(theta, i)[FORCE]
        keep = log.keep[FORCE]
        time, gap = log.motion.time[keep], (log.measured[FORCE] - expected)[keep]
        found.append(missing_along(log.name, time, gap, variance[keep], (FORCE, "N"), strength))
    return found


def bench_operating_point(predicted: PredictedLogs, stroke: float) -> OperatingPoint:
    """The piston at every row: imposed motion, and the rod force that the model predicts.

    `stroke` [m] of the rig's cylinder.
    """
    parts = []
    for i, log in enumerate(predicted.logs):
        force, _ = predicted.readings({}, i)["piston/F"]
        table = np.stack([log.motion.x, log.motion.v, force])
        parts += [table[:, log.keep[channel]] for channel in log.measured]
    x, v, force = np.concatenate(parts, axis=1)
    return OperatingPoint(x, v, force, stroke)


def switchings(log: BenchLog) -> Changes:
    """Valve name -> instants [s] of the commands, and +1 or -1 for on and off."""
    sides = zip(("extend", "retract"), log.commands, strict=True)
    return {f"valve/{side}": changes(sent) for side, sent in sides}


def bench_force_channel(predicted: PredictedLogs, rows: Rows, at: OperatingPoint) -> ForceChannel:
    """The rod: a missing force shows in the force channel, sample by sample."""
    force = rows.channel == rows.channels.index("piston/F")
    sigma = _sigma(predicted)

    def columns(flags: Array) -> Array:
        return np.asarray(flags * (force / sigma)[:, None])

    moving = force & (rows.phase == "moving")
    quantities = {
        "speed [m/s]": np.where(moving, at.v, np.nan),
        "position [mm]": np.where(force, 1e3 * at.x, np.nan),
        "model force [N]": np.where(force, at.force, np.nan),
    }
    after = {}
    for side in ("extend", "retract"):
        after[side] = np.zeros((len(rows), len(lags()) - 1))
        for i, log in enumerate(predicted.logs):
            own = rows.run == i
            after[side][own] = risen(*switchings(log)[f"valve/{side}"], rows.time[own])
    usual = BenchLogSettings.friction
    return ForceChannel("rod", "N", usual, quantities, columns, after)


def _sigma(predicted: PredictedLogs) -> Array:
    """1 sigma (n,) that every row was divided by, in the row's unit."""
    return np.concatenate(
        [
            np.sqrt(variance)[log.keep[channel]]
            for i, log in enumerate(predicted.logs)
            for channel, (_, variance) in predicted.readings({}, i).items()
        ]
    )


MEMORIES = (0.001, 0.006, 0.02, 0.06, 0.2)  # times for which a switching is remembered [s]
CREEPS = (0.002, 0.006, 0.015)  # travel over which a hysteresis turns round [m]
SPEED = 0.3  # speed by which speeds are scaled [m.s-1]


def terms(motion: SmoothedMotion, u: Array, stroke: float) -> Iterator[tuple[str, Array]]:
    """(formula, force per unit coefficient (n,)); `u` (n, 2): share of each valve being on;
    `stroke` [m]."""
    x, v, (u_e, u_r) = motion.x, motion.v, u.T
    sign = np.tanh(v / V_COULOMB)
    out, back = np.maximum(v, 0.0), np.minimum(v, 0.0)
    yield from end_terms(x, stroke)
    yield f"x - {stroke / 2:g}", x - stroke / 2
    yield f"(x - {stroke / 2:g})**2", (x - stroke / 2) ** 2
    yield f"(x - {stroke / 2:g})**3", (x - stroke / 2) ** 3
    yield "x*u_e", x * u_e
    yield "x*u_r", x * u_r
    yield "max(v, 0)", out
    yield "max(v, 0)*u_e", out * u_e
    yield "max(v, 0)*u_r", out * u_r
    yield "min(v, 0)*u_e", back * u_e
    yield "min(v, 0)*u_r", back * u_r
    yield "v*x", v * x
    yield "v**3", v**3
    yield f"tanh(v/{V_COULOMB:g})*u_e", sign * u_e
    yield f"tanh(v/{V_COULOMB:g})*u_r", sign * u_r
    yield f"tanh(v/{V_COULOMB:g})*x", sign * x
    yield f"max(tanh(v/{V_COULOMB:g}), 0)", np.maximum(sign, 0.0)
    yield "a", motion.a
    yield "u_e", u_e
    yield "u_r", u_r
    for travel in CREEPS:
        yield f"dahl(x, {travel:g})", dahl(x, travel)


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


PEAK = 99.5  # percentile of the rows that is taken as the largest [%]


def formula_columns(predicted: PredictedLogs, theta: Theta) -> tuple[tuple[str, ...], Array]:
    """Formulas, and their columns (n, k) of the residual, not whitened, per unit of coefficient."""
    parts: dict[str, list[Array]] = {}
    for i, log in enumerate(predicted.logs):
        forces = _forces(predicted, theta, i)
        for channel, (_, variance) in predicted.readings(theta, i).items():
            keep = log.keep[channel]
            for formula, force in forces.items():
                column = force if channel == "piston/F" else np.zeros(len(force))
                parts.setdefault(formula, []).append((column / np.sqrt(variance))[keep])
    return tuple(parts), np.stack([np.concatenate(p) for p in parts.values()], axis=1)


def formula_weight(predicted: PredictedLogs, theta: Theta, formula: str) -> float:
    """Largest force of a formula per unit of its coefficient, as a share of a usual friction."""
    forces = (_forces(predicted, theta, i)[formula] for i in range(len(predicted.logs)))
    peak = max(float(np.percentile(np.abs(force), PEAK)) for force in forces)
    return peak / BenchLogSettings.friction


def leftover(
    predicted: PredictedLogs, theta: Theta, candidates: Mapping[str, Candidate]
) -> Leftover:
    """Force residual over its noise and over what every model leaves, and what it may depend on."""
    parts = []
    for i, log in enumerate(predicted.logs):
        spread = _imperfection(predicted, i, candidates)
        r = predicted.standardised(theta, i)["piston/F"] / spread
        seen = features(predicted.motion(theta, i), predicted.acting(theta, i), predicted.stroke)
        parts.append((r, seen[log.keep["piston/F"]], np.full(len(r), i)))
    residual, columns, run = (np.concatenate(p) for p in zip(*parts, strict=True))
    return Leftover(residual, columns, run)


def _forces(predicted: PredictedLogs, theta: Theta, index: int) -> dict[str, Array]:
    """Formula -> force (n,) per unit of its coefficient along one log."""
    motion, acting = predicted.motion(theta, index), predicted.acting(theta, index)
    return dict(terms(motion, acting, predicted.stroke))


def _imperfection(
    predicted: PredictedLogs, index: int, candidates: Mapping[str, Candidate]
) -> Array:
    """Spread (n,) of the force residual, in noise units, when every effect of the catalogue may
    be there with a small share of its size."""
    base = predicted.standardised({}, index)["piston/F"]
    power, spike = np.ones(len(base)), SpikeSlabSettings.spike
    for c in candidates.values():
        small = within(candidates, {c.key: c.lead.off + spike * c.lead.size})
        power += (predicted.standardised(small, index)["piston/F"] - base) ** 2
    return np.asarray(np.sqrt(power))
