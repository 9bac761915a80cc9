"""From the robot's seven measured coordinates to the nine bodies and back."""

import numpy as np

from .bodies import NQ
from .figures import (
    CLOSED,
    CYLINDER_COM,
    FEMUR,
    FEMUR_COM,
    HALF_BODY,
    LEVER,
    MOUNT,
    ROD_COM,
    TIBIA,
    TIBIA_COM,
    knee_flexion,
)


def _along(angle: float) -> np.ndarray:
    return np.array([np.sin(angle), -np.cos(angle)])


def _aside(angle: float) -> np.ndarray:
    return np.array([np.cos(angle), np.sin(angle)])


def place(x, z, pitch, hips, pistons) -> np.ndarray:
    """Body coordinates of a pose given by the measured coordinates (front, rear)."""
    q = np.zeros(NQ)
    q[0:3] = x, z, pitch
    for leg, s in ((0, 1.0), (1, -1.0)):
        f = 3 + 12 * leg
        hip = np.array([x, z]) + s * HALF_BODY * _aside(pitch)
        a = pitch + hips[leg]
        t = a + s * knee_flexion(pistons[leg])
        knee = hip + FEMUR * _along(a)
        pivot = hip + s * MOUNT * _aside(a)
        pin = knee + LEVER * _along(t)
        d = (pin - pivot) / np.linalg.norm(pin - pivot)
        b = a + np.arctan2(*(d @ np.array([_aside(a), _along(a)]).T))
        q[f : f + 3] = *(hip + FEMUR_COM * _along(a)), a
        q[f + 3 : f + 6] = *(knee + TIBIA_COM * _along(t)), t
        q[f + 6 : f + 9] = *(pivot + CYLINDER_COM * d), b
        q[f + 9 : f + 12] = *(pin - ROD_COM * d), b
    return q


def push(x, z, pitch, hips, pistons, rates) -> tuple[np.ndarray, np.ndarray]:
    """Pose and velocity; `rates` = (vx, vz, pitch', hip' x2, piston' x2), by central difference."""
    state = np.array([x, z, pitch, *hips, *pistons], dtype=float)
    rates = np.asarray(rates, dtype=float)
    step = 1e-6

    def pose(y):
        return place(y[0], y[1], y[2], y[3:5], y[5:7])

    velocity = (pose(state + step * rates) - pose(state - step * rates)) / (2.0 * step)
    return pose(state), velocity


def feet(q: np.ndarray) -> np.ndarray:
    """Foot positions, shape (..., 2 legs, 2)."""
    q = np.asarray(q)
    out = np.empty((*q.shape[:-1], 2, 2))
    for leg in range(2):
        t = 6 + 12 * leg
        reach = TIBIA - TIBIA_COM
        out[..., leg, 0] = q[..., t] + reach * np.sin(q[..., t + 2])
        out[..., leg, 1] = q[..., t + 1] - reach * np.cos(q[..., t + 2])
    return out


def knees(q: np.ndarray) -> np.ndarray:
    """Knee positions, shape (..., 2 legs, 2)."""
    q = np.asarray(q)
    out = np.empty((*q.shape[:-1], 2, 2))
    for leg in range(2):
        f = 3 + 12 * leg
        reach = FEMUR - FEMUR_COM
        out[..., leg, 0] = q[..., f] + reach * np.sin(q[..., f + 2])
        out[..., leg, 1] = q[..., f + 1] - reach * np.cos(q[..., f + 2])
    return out


def measured(q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(x, z, pitch, hip front/rear, piston front/rear) and their rates along the last axis."""
    y, w = np.empty((*q.shape[:-1], 7)), np.empty((*q.shape[:-1], 7))
    y[..., 0:3], w[..., 0:3] = q[..., 0:3], v[..., 0:3]
    for leg in range(2):
        f = 3 + 12 * leg
        b, r = f + 6, f + 9
        y[..., 3 + leg] = q[..., f + 2] - q[..., 2]
        w[..., 3 + leg] = v[..., f + 2] - v[..., 2]
        sb, cb = np.sin(q[..., b + 2]), np.cos(q[..., b + 2])
        y[..., 5 + leg] = (q[..., r] - q[..., b]) * sb - (q[..., r + 1] - q[..., b + 1]) * cb
        y[..., 5 + leg] -= CLOSED
        w[..., 5 + leg] = (v[..., r] - v[..., b]) * sb - (v[..., r + 1] - v[..., b + 1]) * cb
    return y, w
