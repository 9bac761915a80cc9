"""Where the links are and what pulls at them: ports of the robot, hips, body and boom."""

import numpy as np

from .air import A_TORQUE, N_AIR
from .bodies import NQ
from .catalogue import (
    B_CABLE,
    B_CABLE_Z,
    B_COM,
    B_COULOMB,
    B_DAMP,
    B_DRAG,
    B_FORCE,
    B_PAYLOAD,
    B_PITCH,
    B_SPRING,
    B_SPRING_Z,
    L_COGGING,
    L_COGGING_N,
    L_GEAR,
    L_HIP_COULOMB,
    L_HIP_DAMP,
    L_HIP_Q0,
    L_HIP_SPRING,
    L_MOTOR_LAG,
    L_TORQUE,
)
from .figures import CLOSED, GRAVITY, TIBIA, TIBIA_COM
from .jit import njit

AIR, SUPPLY = 2 * NQ, 2 * NQ + 2 * N_AIR
# Columns of the scalar figures handed to the kernel.
S_ROTOR, S_BOOM_MX, S_BOOM_MZ, S_BOOM_W, S_MU, S_PHYSICAL, S_GROUND, S_COUNT = range(8)


@njit
def piston_state(y, leg):
    b, r = 9 + 12 * leg, 12 + 12 * leg
    s, c = np.sin(y[b + 2]), np.cos(y[b + 2])
    x = (y[r] - y[b]) * s - (y[r + 1] - y[b + 1]) * c - CLOSED
    v = (y[NQ + r] - y[NQ + b]) * s - (y[NQ + r + 1] - y[NQ + b + 1]) * c
    return x, v, s, -c


@njit
def foot_state(y, leg):
    t = 6 + 12 * leg
    s, c = np.sin(y[t + 2]), np.cos(y[t + 2])
    reach = TIBIA - TIBIA_COM
    w = y[NQ + t + 2]
    return (
        y[t] + reach * s,
        y[t + 1] - reach * c,
        y[NQ + t] + reach * c * w,
        y[NQ + t + 1] + reach * s * w,
        reach * c,
        reach * s,
    )


@njit
def near_ground(y):
    return min(foot_state(y, 0)[1], foot_state(y, 1)[1]) < 0.004


@njit
def hip_force(leg, y, command, row):
    """Torque on the femur: motor chain, then friction and the other hip effects."""
    f = 3 + 12 * leg
    angle, speed = y[f + 2] - y[2], y[NQ + f + 2] - y[NQ + 2]
    torque = row[L_TORQUE] * command
    if row[L_MOTOR_LAG] > 0.0:
        torque = y[AIR + N_AIR * leg + A_TORQUE]
    total = torque - row[L_HIP_COULOMB] * np.tanh(speed / 0.1) - row[L_HIP_DAMP] * speed
    total -= row[L_HIP_SPRING] * (angle - row[L_HIP_Q0])
    total += row[L_COGGING] * np.sin(row[L_COGGING_N] * angle)
    total -= row[L_GEAR] * abs(torque) * np.tanh(speed / 0.1)
    return total


@njit
def body_force(y, push, body, s, mass, f):
    """Gravity on every link, the boom, and the effects on the body, added to `f`."""
    for i in range(9):
        f[3 * i + 1] -= mass[i] * GRAVITY
    z, vx, vz, w = y[1], y[NQ], y[NQ + 1], y[NQ + 2]
    offset = body[B_COM]
    c, sn = np.cos(y[2]), np.sin(y[2])
    f[0] += mass[0] * offset * w * w * c
    f[1] += mass[0] * offset * w * w * sn
    f[2] -= mass[0] * GRAVITY * offset * c
    f[1] -= s[S_BOOM_W] + body[B_PAYLOAD] * GRAVITY
    f[1] += body[B_FORCE] - body[B_SPRING] * (z - body[B_SPRING_Z])
    f[1] -= body[B_CABLE] * max(0.0, z - body[B_CABLE_Z])
    f[0] -= body[B_COULOMB] * np.tanh(vx / 0.02) + body[B_DAMP] * vx + body[B_DRAG] * vx * abs(vx)
    f[1] -= body[B_COULOMB] * np.tanh(vz / 0.02) + body[B_DAMP] * vz + body[B_DRAG] * vz * abs(vz)
    f[2] -= body[B_PITCH] * np.tanh(w / 0.05)
    f[0] += push[0]
    f[1] += push[1]
    f[2] += push[2]
