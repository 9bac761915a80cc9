"""Chambers and rod force of one piston, shared by the robot and by the bench rig.

Air state per leg `a`: [chamber e, chamber r, filtered u_e, filtered u_r, torque at the joint,
hysteresis force].  A chamber's state is its force (first order, eq. 4-5) or, with `physical`,
its absolute pressure (eq. 1-3 with the compression term's sign put right).
"""

import numpy as np

from .catalogue import (
    L_BOTH,
    L_CHECK,
    L_CUSHION,
    L_CUSHION_L,
    L_DAHL,
    L_DAHL_X,
    L_DAMP,
    L_GAS,
    L_HOSE,
    L_LEAK,
    L_MAGNET,
    L_MAGNET_D,
    L_NEGATIVE,
    L_PRESSURE,
    L_QUAD,
    L_RISE,
    L_SEAL,
    L_STRIBECK,
    L_STRIBECK_V,
    L_SUPPLY,
)
from .figures import (
    AREA_E,
    AREA_R,
    ATMOSPHERE,
    GAS_R,
    GAS_T,
    KAPPA,
    N_C00,
    N_C01,
    N_C10,
    N_C11,
    N_DEAD_E,
    N_FE,
    N_FILL,
    N_FR,
    N_PS,
    N_ROD_C,
    N_TF0,
    N_TF1,
    N_TV0,
    N_TV1,
    N_VENT,
    STROKE,
)
from .jit import njit

N_AIR = 6
A_UE, A_UR, A_TORQUE, A_DAHL = 2, 3, 4, 5
_CHOKED = (2.0 / (KAPPA + 1.0)) ** (KAPPA / (KAPPA - 1.0))


@njit
def time_constant(u, stroke, air, scale):
    """Eq. 5: bilinear in the valve and in the chamber's own extension."""
    share = stroke / STROKE
    fill = air[N_TF0] + share * (air[N_TF1] - air[N_TF0])
    vent = air[N_TV0] + share * (air[N_TV1] - air[N_TV0])
    return scale * (u * fill + (1.0 - u) * vent)


@njit
def thin_plate(up, down):
    """Eq. 3, mass flow per unit of effective area; linear close to equal pressures."""
    ratio = max(down / up, _CHOKED)
    near = 0.9995
    if ratio > near:
        shape = (
            (1.0 - ratio)
            / (1.0 - near)
            * np.sqrt(near ** (2.0 / KAPPA) - near ** ((KAPPA + 1.0) / KAPPA))
        )
    else:
        shape = np.sqrt(ratio ** (2.0 / KAPPA) - ratio ** ((KAPPA + 1.0) / KAPPA))
    return up * np.sqrt(2.0 * KAPPA / ((KAPPA - 1.0) * GAS_R * GAS_T)) * shape


@njit
def flow(up, down):
    if up >= down:
        return thin_plate(up, down)
    return -thin_plate(down, up)


@njit
def valve_output(u_e, u_r, a, leg):
    """What the chambers feel: the switched valve, or the hose's filtered version of it."""
    if leg[L_HOSE] > 0.0:
        return a[A_UE], a[A_UR]
    return u_e, u_r


@njit
def chamber_forces(a, physical):
    if physical:
        return AREA_E * (a[0] - ATMOSPHERE), AREA_R * (a[1] - ATMOSPHERE)
    return a[0], a[1]


@njit
def air_rates(x, v, u_e, u_r, a, s, air, leg, physical, out):
    """Rates of chambers and hoses into `out`; returns the demand on the shared supply."""
    w_e, w_r = valve_output(u_e, u_r, a, leg)
    hose = leg[L_HOSE]
    out[A_UE] = (u_e - a[A_UE]) / hose if hose > 0.0 else 0.0
    out[A_UR] = (u_r - a[A_UR]) / hose if hose > 0.0 else 0.0
    tau_e = time_constant(w_e, x, air, leg[L_RISE])
    tau_r = time_constant(w_r, STROKE - x, air, leg[L_RISE])
    full_e, full_r = leg[L_SUPPLY] * air[N_FE], leg[L_SUPPLY] * air[N_FR]
    force_e, force_r = chamber_forces(a, physical)
    if physical:
        gauge = leg[L_SUPPLY] * (air[N_PS] - ATMOSPHERE)
        full_e, full_r = gauge * AREA_E, gauge * AREA_R
        source = ATMOSPHERE + s * gauge
        for c in range(2):
            u, area, length, speed = w_e, AREA_E, x, v
            if c == 1:
                u, area, length, speed = w_r, AREA_R, STROKE - x, -v
            volume = air[N_DEAD_E + c] + area * length
            # a slower rise is a smaller orifice, filling and venting alike
            mass = (
                u * air[N_FILL] * flow(source, a[c])
                - (1.0 - u) * air[N_VENT] * flow(a[c], ATMOSPHERE)
            ) / leg[L_RISE]
            out[c] = KAPPA * (GAS_R * GAS_T * mass - a[c] * area * speed) / volume
        leak = leg[L_LEAK] * (a[0] - a[1])
        out[0] -= leak
        out[1] += leak
    else:
        out[0] = (s * full_e * w_e - a[0]) / tau_e
        out[1] = (s * full_r * w_r - a[1]) / tau_r
        leak = leg[L_LEAK] * (a[0] / AREA_E - a[1] / AREA_R)
        out[0] -= leak * AREA_E
        out[1] += leak * AREA_R
    if leg[L_DAHL] > 0.0:
        out[A_DAHL] = (v - abs(v) * a[A_DAHL] / leg[L_DAHL]) * leg[L_DAHL] / leg[L_DAHL_X]
    else:
        out[A_DAHL] = 0.0
    need_e = w_e * max(0.0, s - force_e / full_e) / tau_e
    need_r = w_r * max(0.0, s - force_r / full_r) / tau_r
    return need_e + need_r


@njit
def rod_force(x, v, u_e, u_r, a, air, leg, physical):
    """Force on the rod, pushing positive: eq. 7 and every effect on the piston port."""
    w_e, w_r = valve_output(u_e, u_r, a, leg)
    force_e, force_r = chamber_forces(a, physical)
    if physical:
        damping = air[N_ROD_C]
    else:
        damping = (
            air[N_C00] * (1.0 - w_e) * (1.0 - w_r)
            + air[N_C10] * w_e * (1.0 - w_r)
            + air[N_C01] * (1.0 - w_e) * w_r
            + air[N_C11] * w_e * w_r
        )
    f = force_e - force_r - damping * v
    f -= leg[L_BOTH] * w_e * w_r
    coulomb = np.tanh(v / 0.01)
    f -= leg[L_SEAL] * coulomb
    f -= leg[L_STRIBECK] * np.exp(-((v / leg[L_STRIBECK_V]) ** 2)) * coulomb
    f -= leg[L_PRESSURE] * (force_e + force_r) * coulomb
    f -= leg[L_DAMP] * v + leg[L_QUAD] * v * abs(v)
    if leg[L_CUSHION] != 0.0:
        gap = STROKE - x if v > 0.0 else x
        gap = max(gap, 0.0)
        if gap < leg[L_CUSHION_L]:
            f -= leg[L_CUSHION] * (1.0 - gap / leg[L_CUSHION_L]) * v
    f -= leg[L_GAS] * (x - 0.5 * STROKE)
    # outside the catalogue
    f -= leg[L_MAGNET] * np.exp(-((x / leg[L_MAGNET_D]) ** 2))
    f += leg[L_NEGATIVE] * (x - 0.5 * STROKE)
    f -= a[A_DAHL]
    f -= leg[L_CHECK] * max(v, 0.0) * w_e  # a sticking check valve: only when pushing out
    return f
