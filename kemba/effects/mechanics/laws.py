"""Laws of friction, each written once: pistons, hips, boom and drives put them at their ports.

Each gives the force [N] or torque [N.m] on the moving part.
"""

from typing import Any

import casadi as ca


def direction(v: Any, width: float) -> Any:
    """The sign of a rate, smooth within `width`."""
    return ca.tanh(v / width)


def coulomb(F: Any, v: Any, width: float) -> Any:
    """Constant friction against the motion."""
    return -F * direction(v, width)


def viscous(c: Any, v: Any) -> Any:
    """Friction proportional to the rate."""
    return -c * v


def fading(v: Any, gone: Any) -> Any:
    """Share of an extra friction near standstill that is left; little beyond the rate `gone`."""
    return ca.exp(-((v / gone) ** 2))


def one_way(F: Any, v: Any, width: float) -> Any:
    """Friction that is larger by F while moving forward, and smaller by F while moving back."""
    return -F * direction(v, width) ** 2


def dahl_rate(z: Any, v: Any, travel: Any) -> Any:
    """Rate [1/s] of the stretch z of contacts that slide (z = 1) after some travel (Dahl, 1968)."""
    return (v - ca.fabs(v) * z) / travel
