"""Forces that a rod may lack beyond the catalogue: simple terms, and what they could depend on."""

from collections.abc import Iterator

import numpy as np

from kemba.effects.mechanics.piston import V_COULOMB
from kemba.identify.bench.motion import SmoothedMotion
from kemba.identify.problem.missing_force import dahl, end_terms
from kemba.identify.problem.types import Array

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
