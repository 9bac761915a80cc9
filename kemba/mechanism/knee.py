"""The closed loop femur - tibia - piston as an analytic map of the knee's flexion."""

from typing import Any

import casadi as ca
import numpy as np

from kemba.mechanism.links import Leg
from kemba.mechanism.planar import Mechanism

Array = np.ndarray[Any, np.dtype[np.float64]]
REACH = 1.0 - 1e-9  # largest cosine of an angle whose slope is still finite


def pivot_to_pin(leg: Leg, flexion: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Vector from the cylinder's pivot to the rod's pin in leg axes [m]: along the femur from
    hip to knee, and to the side on which the tibia folds."""
    piston = leg.piston
    along = leg.femur.length + piston.pin * ca.cos(flexion)
    aside = piston.pin * ca.sin(flexion) - piston.mount
    return along, aside


def extension(leg: Leg, flexion: ca.SX) -> ca.SX:
    """Piston extension [m] for a knee flexion [rad]: 0 with the rod in."""
    along, aside = pivot_to_pin(leg, flexion)
    return ca.sqrt(along**2 + aside**2) - leg.piston.retracted


def cylinder_angle(leg: Leg, flexion: ca.SX) -> ca.SX:
    """Angle [rad] of the cylinder against the femur, positive towards the folding side."""
    along, aside = pivot_to_pin(leg, flexion)
    return ca.atan2(aside, along)


def flexion(leg: Leg, x: float) -> float:
    """Knee flexion [rad] for a piston extension `x` [m]; 0 is a straight leg. Raises ValueError
    where the linkage cannot reach."""
    return float(flexions(leg, np.array([x]))[0])


def flexions(leg: Leg, x: Array) -> Array:
    """Knee flexions (n,) [rad] for piston extensions `x` (n,) [m]. Raises as `flexion` does."""
    cosine, phase = _triangle(leg, x)
    if np.any(beyond := np.abs(cosine) > 1.0):
        least, most = (1e3 * length for length in extensions(leg))
        reach = f"it reaches {least:.1f} to {most:.1f} mm"
        far = f"the knee cannot reach a piston extension of {1e3 * x[beyond][0]:.1f} mm"
        raise ValueError(f"{far}; {reach}")
    return np.asarray(np.arccos(cosine) - np.arctan2(*phase))


def extensions(leg: Leg) -> tuple[float, float]:
    """The least and the largest piston extension [m] at which the linkage closes, whatever the
    stroke."""
    femur = (leg.femur.length**2 + leg.piston.mount**2) ** 0.5
    ends = abs(femur - leg.piston.pin), femur + leg.piston.pin
    return ends[0] - leg.piston.retracted, ends[1] - leg.piston.retracted


def flexion_of(leg: Leg, x: ca.SX) -> ca.SX:
    """The same as an expression; where the linkage cannot reach, the knee ends at its limit."""
    cosine, phase = _triangle(leg, x)
    bend: ca.SX = ca.acos(ca.fmax(-REACH, ca.fmin(REACH, cosine))) - ca.atan2(*phase)
    return bend


def _triangle(leg: Leg, x: Any) -> tuple[Any, tuple[Any, Any]]:
    """Cosine of the flexion plus a phase, and the two sides whose angle that phase is."""
    piston, femur = leg.piston, leg.femur.length
    d = piston.retracted + x
    # |d|^2 = f^2 + p^2 + m^2 + 2 p (f cos k - m sin k) = f^2 + p^2 + m^2 + 2 p r cos(k + phase)
    reach = (femur**2 + piston.mount**2) ** 0.5
    cosine = (d**2 - femur**2 - piston.pin**2 - piston.mount**2) / (2 * piston.pin * reach)
    return cosine, (piston.mount, femur)


def leg_per_piston(leg: Leg, x: float) -> float:
    """By how much the distance from hip to foot grows per piston extension [1], at `x` [m]."""
    bend = ca.SX.sym("bend")
    f, t = leg.femur.length, leg.tibia.length
    length = ca.sqrt(f**2 + t**2 + 2 * f * t * ca.cos(bend))
    ratio = ca.jacobian(length, bend) / ca.jacobian(extension(leg, bend), bend)
    return float(ca.Function("ratio", [bend], [ratio])(flexion(leg, x)))


def felt(mechanism: Mechanism, label: str) -> float:
    """Speed of an impact per speed at which its gap closes [1].

    `label`: of the pair. A foot counts by itself. A piston at its stop counts by how fast the
    distance from hip to foot changes there: with bent knees a slow piston goes with a fast body.
    """
    pair = label.rpartition("/")[2]
    places = {"end_stop:retracted": 0.0, "end_stop:extended": mechanism.stroke}
    if pair not in places:
        return 1.0
    return abs(leg_per_piston(mechanism.need_robot().leg, places[pair]))
