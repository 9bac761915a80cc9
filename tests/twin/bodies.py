"""Nine planar bodies in world coordinates, held together by Lagrange multipliers.

q = (x, z, angle) per body: the body link's geometric centre, then per leg (front first) the centres
of femur, tibia, piston body and piston rod.  A link at angle a points along (sin a, -cos a).
Twenty constraint rows leave the seven freedoms of the robot.
"""

import numpy as np

from .figures import (
    CYLINDER_COM,
    FEMUR,
    FEMUR_COM,
    HALF_BODY,
    LEVER,
    MOUNT,
    ROD_COM,
    TIBIA_COM,
)
from .jit import njit

NQ, NC = 27, 20
# Indices coupled in the mass matrix: body x, z, angle and the two femur angles (hip rotors).
_B0, _B1, _B2, _B3, _B4 = 0, 1, 2, 5, 17


@njit
def constraints(q, v, index, value, gap, bias):
    """Rows of the constraint Jacobian (6 entries each), their gaps and -d/dt(G) v into `bias`."""
    p, wp = q[2], v[2]
    cp, sp = np.cos(p), np.sin(p)
    for leg in range(2):
        s = 1.0 - 2.0 * leg
        f, r0 = 3 + 12 * leg, 10 * leg
        t, b, r = f + 3, f + 6, f + 9
        ca, sa, wa = np.cos(q[f + 2]), np.sin(q[f + 2]), v[f + 2]
        ct, st, wt = np.cos(q[t + 2]), np.sin(q[t + 2]), v[t + 2]
        cb, sb, wb = np.cos(q[b + 2]), np.sin(q[b + 2]), v[b + 2]
        cr, sr, wr = np.cos(q[r + 2]), np.sin(q[r + 2]), v[r + 2]
        h = s * HALF_BODY
        m = s * MOUNT
        # hip: body end = upper end of the femur
        _pin(r0, 0, f, h * cp, h * sp, -FEMUR_COM * sa, FEMUR_COM * ca, wp, wa,
             q, index, value, gap, bias)  # fmt: skip
        # knee: lower end of the femur = upper end of the tibia
        _pin(r0 + 2, f, t, (FEMUR - FEMUR_COM) * sa, -(FEMUR - FEMUR_COM) * ca,
             -TIBIA_COM * st, TIBIA_COM * ct, wa, wt, q, index, value, gap, bias)  # fmt: skip
        # the piston's pivot, carried by the femur beside the hip
        _pin(r0 + 4, f, b, -FEMUR_COM * sa + m * ca, FEMUR_COM * ca + m * sa,
             -CYLINDER_COM * sb, CYLINDER_COM * cb, wa, wb, q, index, value, gap, bias)  # fmt: skip
        # the rod's end on the tibia
        _pin(r0 + 6, t, r, (LEVER - TIBIA_COM) * st, -(LEVER - TIBIA_COM) * ct,
             ROD_COM * sr, -ROD_COM * cr, wt, wr, q, index, value, gap, bias)  # fmt: skip
        # slider: rod and cylinder stay parallel ...
        k = r0 + 8
        index[k, :] = r + 2
        value[k, :] = 0.0
        index[k, 0], value[k, 0] = b + 2, 1.0
        index[k, 1], value[k, 1] = r + 2, -1.0
        gap[k], bias[k] = q[b + 2] - q[r + 2], 0.0
        # ... and the rod's centre stays on the cylinder's axis
        k = r0 + 9
        dx, dz = q[r] - q[b], q[r + 1] - q[b + 1]
        ux, uz = v[r] - v[b], v[r + 1] - v[b + 1]
        index[k, 0], value[k, 0] = r, cb
        index[k, 1], value[k, 1] = r + 1, sb
        index[k, 2], value[k, 2] = b, -cb
        index[k, 3], value[k, 3] = b + 1, -sb
        index[k, 4], value[k, 4] = b + 2, -dx * sb + dz * cb
        index[k, 5], value[k, 5] = r + 2, 0.0
        gap[k] = dx * cb + dz * sb
        bias[k] = 2.0 * wb * (ux * sb - uz * cb) + wb * wb * (dx * cb + dz * sb)


@njit
def _pin(row, one, two, ax, az, bx, bz, wa, wb, q, index, value, gap, bias):
    """Two rows: the point at offset a of body `one` is the point at offset b of body `two`."""
    for i in range(2):
        k = row + i
        index[k, 0], value[k, 0] = one + i, 1.0
        index[k, 1], value[k, 1] = two + i, -1.0
        index[k, 2], index[k, 3] = one + 2, two + 2
        index[k, 4], index[k, 5] = two, two + 1
        value[k, 4] = value[k, 5] = 0.0
    value[row, 2], value[row, 3] = -az, bz
    value[row + 1, 2], value[row + 1, 3] = ax, -bx
    gap[row] = q[one] + ax - q[two] - bx
    gap[row + 1] = q[one + 1] + az - q[two + 1] - bz
    bias[row] = wa * wa * ax - wb * wb * bx
    bias[row + 1] = wa * wa * az - wb * wb * bz


@njit
def inverse_mass(q, mass, inertia, boom_mx, boom_mz, payload, offset, rotor_f, rotor_r, w, block):
    """Diagonal of M^-1 into `w`, the coupled 5 x 5 part into `block`; the boom acts on x and z."""
    for i in range(9):
        w[3 * i] = w[3 * i + 1] = 1.0 / mass[i]
        w[3 * i + 2] = 1.0 / inertia[i]
    block[:, :] = 0.0
    c, s = np.cos(q[2]), np.sin(q[2])
    block[0, 0] = mass[0] + boom_mx + payload
    block[1, 1] = mass[0] + boom_mz + payload
    block[0, 2] = block[2, 0] = -mass[0] * offset * s
    block[1, 2] = block[2, 1] = mass[0] * offset * c
    block[2, 2] = inertia[0] + mass[0] * offset * offset + rotor_f + rotor_r
    block[3, 3], block[4, 4] = inertia[1] + rotor_f, inertia[5] + rotor_r
    block[2, 3] = block[3, 2] = -rotor_f
    block[2, 4] = block[4, 2] = -rotor_r
    _invert(block)


@njit
def _invert(a):
    """Gauss-Jordan in place; fine without pivoting for a positive definite matrix."""
    n = a.shape[0]
    for k in range(n):
        pivot = 1.0 / a[k, k]
        a[k, k] = 1.0
        for j in range(n):
            a[k, j] *= pivot
        for i in range(n):
            if i != k:
                factor = a[i, k]
                a[i, k] = 0.0
                for j in range(n):
                    a[i, j] -= factor * a[k, j]


@njit
def _slot(j):
    if j < 3:
        return j
    if j == _B3:
        return 3
    if j == _B4:
        return 4
    return -1


@njit
def apply_inverse(w, block, f, out):
    """out = M^-1 f."""
    for j in range(NQ):
        out[j] = w[j] * f[j]
    for i in range(5):
        j = i if i < 3 else (_B3 if i == 3 else _B4)
        out[j] = (
            block[i, 0] * f[_B0]
            + block[i, 1] * f[_B1]
            + block[i, 2] * f[_B2]
            + block[i, 3] * f[_B3]
            + block[i, 4] * f[_B4]
        )


@njit
def factor(index, value, w, block, wg, a):
    """wg = M^-1 G', and the Cholesky factor of G M^-1 G' (lower) into `a`."""
    wg[:, :] = 0.0
    for r in range(NC):
        for n in range(6):
            g = value[r, n]
            if g == 0.0:
                continue
            j = index[r, n]
            k = _slot(j)
            if k < 0:
                wg[r, j] += w[j] * g
            else:
                wg[r, 0] += block[0, k] * g
                wg[r, 1] += block[1, k] * g
                wg[r, 2] += block[2, k] * g
                wg[r, _B3] += block[3, k] * g
                wg[r, _B4] += block[4, k] * g
    for r in range(NC):
        for c in range(r + 1):
            total = 0.0
            for n in range(6):
                total += value[r, n] * wg[c, index[r, n]]
            a[r, c] = total
    for c in range(NC):
        for k in range(c):
            a[c, c] -= a[c, k] * a[c, k]
        a[c, c] = np.sqrt(a[c, c])
        scale = 1.0 / a[c, c]
        for r in range(c + 1, NC):
            total = a[r, c]
            for k in range(c):
                total -= a[r, k] * a[c, k]
            a[r, c] = total * scale


@njit
def solve(a, y):
    """Solve with the Cholesky factor, in place."""
    for i in range(NC):
        total = y[i]
        for k in range(i):
            total -= a[i, k] * y[k]
        y[i] = total / a[i, i]
    for i in range(NC - 1, -1, -1):
        total = y[i]
        for k in range(i + 1, NC):
            total -= a[k, i] * y[k]
        y[i] = total / a[i, i]


def masses(robot):
    """Mass or inertia (NQ,) of every coordinate, the boom's included, the hip rotors' not."""
    m = np.zeros(NQ)
    m[0::3], m[1::3], m[2::3] = robot.mass, robot.mass, robot.inertia
    m[0] += robot.boom_mx
    m[1] += robot.boom_mz
    return m
