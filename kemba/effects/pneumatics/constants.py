"""Fixed figures that several effects share: the cylinder's areas and air."""

from __future__ import annotations

import math

BORE, ROD = 0.025, 0.010  # m; data sheet DSNU-25-70-PPS-A
AREA_E = math.pi / 4 * BORE**2  # m2, extend chamber
AREA_R = math.pi / 4 * (BORE**2 - ROD**2)  # m2, retract chamber: the rod takes its share
ATMOSPHERE = 101325.0  # Pa
KAPPA = 1.4  # air, ratio of specific heats
GAS = 287.0  # J.kg-1.K-1, air
TEMPERATURE = 293.0  # K
