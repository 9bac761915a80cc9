"""Fixed figures of air that several effects share."""

from __future__ import annotations

ATMOSPHERE = 101325.0  # Pa
KAPPA = 1.4  # air, ratio of specific heats
GAS = 287.0  # J.kg-1.K-1, air
TEMPERATURE = 293.0  # K
