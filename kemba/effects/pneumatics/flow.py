"""Figures of air, and its flow through a thin-plate orifice (paper, eq. 2 and 3), smooth through
equal pressures."""

import math
from typing import Any

import casadi as ca

ATMOSPHERE = 101325.0  # Pa
KAPPA = 1.4  # air, ratio of specific heats
GAS = 287.0  # J.kg-1.K-1, air
TEMPERATURE = 293.0  # K


CHOKED = (2 / (KAPPA + 1)) ** (KAPPA / (KAPPA - 1))  # P_d/P_u = 1/theta = 0.528
SUBSONIC = math.sqrt(2 * KAPPA / ((KAPPA - 1) * GAS * TEMPERATURE))  # alpha of eq. 3, s.m-1
SOFT = 1e-4  # of psi^2; sqrt has an infinite slope at equal pressures, this rounds it


def psi(ratio: Any) -> Any:
    """Flow number of eq. 3 at P_d/P_u; it stays at its choked value below 0.528, is 0 from 1."""
    r = ca.fmin(1, ca.fmax(CHOKED, ratio))
    square = r ** (2 / KAPPA) - r ** ((KAPPA + 1) / KAPPA)
    return square / ca.sqrt(square + SOFT)


def phi(P_u: Any, P_d: Any) -> Any:
    """Mass flow per area [kg.s-1.m-2] from P_u down to P_d [Pa]; 0 where P_d is the higher."""
    return SUBSONIC * P_u * psi(P_d / P_u)


def mass_flow(area: Any, P_1: Any, P_2: Any) -> Any:
    """Mass flow [kg.s-1] through `area` [m2] from 1 to 2, negative when it runs back (eq. 2)."""
    return area * (phi(P_1, P_2) - phi(P_2, P_1))
