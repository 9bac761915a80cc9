"""Ground and end stops as stiff, overdamped springs: as good as rigid, and hardly any rebound."""

from .catalogue import B_GROUND_D, B_GROUND_K, B_MU
from .figures import STROKE
from .jit import njit

GROUND_K, GROUND_C = 4.0e6, 5.5e3
SIDE_K, SIDE_C = 2.0e6, 2.5e3
STOP_K, STOP_C = 2.0e7, 6.0e4
_SOFT = 3.0e-5  # damping grows over this depth, so that the force starts from zero


@njit
def foot_normal(depth, rate, body):
    """Normal force at penetration `depth` > 0 growing at `rate`."""
    if depth <= 0.0:
        return 0.0
    if body[B_GROUND_K] > 0.0:
        return max(0.0, body[B_GROUND_K] * depth * (1.0 + body[B_GROUND_D] * rate))
    return max(0.0, GROUND_K * depth + GROUND_C * min(1.0, depth / _SOFT) * rate)


@njit
def foot_tangent(slip, speed, normal, body, mu):
    """Friction from a spring stretched by `slip` since the foot last stuck, capped by Coulomb."""
    force = -SIDE_K * slip - SIDE_C * speed
    limit = mu * body[B_MU] * normal
    return min(max(force, -limit), limit)


@njit
def creep(anchor, x, normal, body, mu):
    """Move the anchor of the friction spring so that it never holds more than Coulomb allows."""
    if normal <= 0.0:
        return x
    reach = mu * body[B_MU] * normal / SIDE_K
    return min(max(anchor, x - reach), x + reach)


@njit
def stop_force(x, v):
    """Force of the piston's two ends on the rod, pushing positive."""
    if x < 0.0:
        return max(0.0, -STOP_K * x - STOP_C * min(1.0, -x / _SOFT) * v)
    if x > STROKE:
        depth = x - STROKE
        return -max(0.0, STOP_K * depth + STOP_C * min(1.0, depth / _SOFT) * v)
    return 0.0
