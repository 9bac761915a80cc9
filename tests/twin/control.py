"""The hip controller (eq. 10) with the motor's torque and speed limits."""

import numpy as np

from .figures import (
    FEMUR,
    LEVER,
    MOUNT,
    NO_LOAD_SPEED,
    PEAK_TORQUE,
    RATED_SPEED,
    RATED_TORQUE,
    STROKE,
    TIBIA,
)
from .jit import njit

# Columns of one control row: angle, rate, torque (2 legs each), follow, kp, kd.
R_Q, R_QD, R_TAU, R_FOLLOW, R_KP, R_KD, R_COUNT = 0, 2, 4, 6, 7, 8, 9
_SLOPE = RATED_TORQUE / (NO_LOAD_SPEED - RATED_SPEED)
_ARM, _TILT = np.hypot(FEMUR, MOUNT), np.arctan2(MOUNT, FEMUR)
_CLOSED_LENGTH = 0.2057


@njit
def fold_angle(x):
    """Angle from the femur to the line hip-foot: what keeps the foot under the hip."""
    length = _CLOSED_LENGTH + min(max(x, 0.0), STROKE)
    k = np.arccos((length**2 - _ARM**2 - LEVER**2) / (2.0 * LEVER * _ARM)) - _TILT
    return np.arctan2(TIBIA * np.sin(k), FEMUR + TIBIA * np.cos(k))


@njit
def limited(torque, speed):
    """Peak torque, and a speed limit that falls linearly to the no-load speed."""
    high = min(PEAK_TORQUE, max(0.0, _SLOPE * (NO_LOAD_SPEED - speed)))
    low = -min(PEAK_TORQUE, max(0.0, _SLOPE * (NO_LOAD_SPEED + speed)))
    return min(max(torque, low), high)


@njit
def hip_command(leg, q, w, x, v, row):
    """PD and feed-forward; with `follow` the reference keeps the foot under the hip."""
    q_ref, w_ref = row[R_Q + leg], row[R_QD + leg]
    if row[R_FOLLOW] > 0.0:
        s = 1.0 - 2.0 * leg
        slope = (fold_angle(x + 1e-5) - fold_angle(x - 1e-5)) / 2e-5
        q_ref -= row[R_FOLLOW] * s * fold_angle(x)
        w_ref -= row[R_FOLLOW] * s * slope * v
    torque = row[R_KP] * (q_ref - q) + row[R_KD] * (w_ref - w) + row[R_TAU + leg]
    return limited(torque, w)
