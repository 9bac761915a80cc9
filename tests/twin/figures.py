"""The robot's figures (SI) as this simulator uses them, typed in by hand."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

GRAVITY = 9.81
# Lengths (m).
HALF_BODY = 0.261
FEMUR, FEMUR_COM = 0.242, 0.095
TIBIA, TIBIA_COM = 0.234, 0.109
MOUNT = 0.031  # piston pivot beside the hip, square to the femur
LEVER = 0.048  # knee to the rod's pin on the tibia
CYLINDER_COM, ROD_COM = 0.0752, 0.0825
CLOSED = 0.048  # distance between the two piston centres when retracted
STROKE = 0.070
# Boom.
BOOM_INERTIA, BOOM_MASS, BOOM_COM = 4.82, 2.699, 1.149
BOOM_X, BOOM_Z = 2.575, 2.493
# Hip motor at the output.
PEAK_TORQUE, NO_LOAD_SPEED = 24.8, 49.7
RATED_TORQUE, RATED_SPEED = 8.3, 41.9
# Pneumatics.
AREA_E = np.pi / 4 * 0.025**2
AREA_R = np.pi / 4 * (0.025**2 - 0.010**2)
ATMOSPHERE = 101325.0
GAS_R, GAS_T, KAPPA = 287.0, 293.0, 1.4
DEAD_TIME = 0.006

# Columns of the per-leg table of nominal air figures, see `Robot.air`.
(
    N_FE, N_FR,  # static forces of the two chambers
    N_C00, N_C10, N_C01, N_C11,  # damping with valves (extend, retract) off/on
    N_TF0, N_TF1, N_TV0, N_TV1,  # time constants: filling and venting, at 0 and at full stroke
    N_PS,  # supply pressure, absolute (orifice chambers)
    N_DEAD_E, N_DEAD_R,  # dead volumes
    N_FILL, N_VENT,  # effective orifice areas
    N_ROD_C,  # rod damping that remains when the chambers are physical
    N_COUNT,
) = range(17)  # fmt: skip

_AIR = np.array([
    324.0, 260.0, 25.0, 97.0, 84.0, 59.0, 0.008, 0.025, 0.013, 0.037,
    0.66e6 + ATMOSPHERE, 17e-6, 17e-6, 3.6e-6, 3.6e-6, 10.0,
])  # fmt: skip

# body, then per leg: femur, tibia, piston body, piston rod (front leg first)
_MASS = np.array([2.886] + 2 * [0.335, 0.159, 0.230, 0.071])
_INERTIA = np.array([0.12362445] + 2 * [0.00298112, 0.00126467, 0.00077710, 0.00022532])


@dataclass(frozen=True)
class Robot:
    """Nominal figures that a case may jitter; geometry stays as drawn."""

    mass: np.ndarray = field(default_factory=_MASS.copy)
    inertia: np.ndarray = field(default_factory=_INERTIA.copy)
    rotor: float = 1.2e-4 * 10.0**2
    boom_mx: float = BOOM_INERTIA / BOOM_X**2
    boom_mz: float = BOOM_INERTIA / BOOM_Z**2
    boom_weight: float = BOOM_MASS * GRAVITY * BOOM_COM / BOOM_Z
    friction: float = 1.0
    air: np.ndarray = field(default_factory=lambda: np.array([_AIR, _AIR]))

    @property
    def total_mass(self) -> float:
        return float(self.mass.sum())

    def jittered(self, rng: np.random.Generator, fraction: float) -> Robot:
        """Every figure off by about `fraction` (1 sigma): no drawing is the machine."""
        if fraction == 0.0:
            return self

        def off(value):
            draw = np.clip(rng.standard_normal(np.shape(value)), -2.5, 2.5)
            return value * (1.0 + fraction * draw)

        return replace(
            self,
            mass=off(self.mass),
            inertia=off(self.inertia),
            rotor=float(off(self.rotor)),
            boom_mx=float(off(self.boom_mx)),
            boom_mz=float(off(self.boom_mz)),
            boom_weight=float(off(self.boom_weight)),
            air=off(self.air),
        )


def knee_flexion(x: float) -> float:
    """Flexion of the knee from straight at piston extension x (law of cosines)."""
    length = CYLINDER_COM + CLOSED + x + ROD_COM
    arm = np.hypot(FEMUR, MOUNT)
    cosine = (length**2 - arm**2 - LEVER**2) / (2.0 * LEVER * arm)
    return float(np.arccos(cosine) - np.arctan2(MOUNT, FEMUR))


def leg_fold(x: float) -> tuple[float, float]:
    """(hip-to-foot length, angle from the femur to that line) at piston extension x."""
    k = knee_flexion(x)
    along, aside = FEMUR + TIBIA * np.cos(k), TIBIA * np.sin(k)
    return float(np.hypot(along, aside)), float(np.arctan2(aside, along))


STANCE_Z, STANCE_HIP = leg_fold(0.0)  # front hip at -STANCE_HIP, rear at +STANCE_HIP
