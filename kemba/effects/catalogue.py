"""Every effect there is, by name, and the families a model can be built from."""

from __future__ import annotations

from collections.abc import Callable

from kemba.effects.base import Effect
from kemba.effects.expression import Expression
from kemba.effects.mechanics.boom import Boom
from kemba.effects.mechanics.boom_faults import (
    BoomDamping,
    BoomForce,
    BoomFriction,
    BoomInertia,
    BoomSpring,
    PitchFriction,
)
from kemba.effects.mechanics.contact import Contact
from kemba.effects.mechanics.friction import PressureFriction, SealFriction, StribeckFriction
from kemba.effects.mechanics.ground import GroundCompliance, GroundFriction
from kemba.effects.mechanics.hip import (
    HipDamping,
    HipFriction,
    HipSpring,
    MotorLag,
    RotorInertia,
    TorqueScale,
)
from kemba.effects.mechanics.load import ComOffset, Payload
from kemba.effects.mechanics.motor import Motor
from kemba.effects.mechanics.piston import EndCushion, GasSpring, PistonDamping, QuadraticDamping
from kemba.effects.mechanics.stops import EndStop
from kemba.effects.pneumatics.chamber import Chamber
from kemba.effects.pneumatics.damping import ModeDamping
from kemba.effects.pneumatics.hose import BothModeLoss, CrossLeak, HoseLag
from kemba.effects.pneumatics.orifice import OrificeChamber
from kemba.effects.pneumatics.supply import RiseTimeScale, SupplyDroop, SupplyScale
from kemba.effects.pneumatics.supply_line import SupplyLine
from kemba.effects.pneumatics.timing import ValveCloseDelay, ValveDelay
from kemba.effects.pneumatics.valve import Valve
from kemba.effects.sensors import SensorBias, SensorDelay, SensorScale

# the planning model's own physics
PLANNING: tuple[type[Effect], ...] = (Valve, Chamber, ModeDamping, EndStop, Motor, Boom, Contact)

# the same air, seen closer
PHYSICAL: tuple[type[Effect], ...] = (OrificeChamber, SupplyLine)

# what a real machine may have beside it
AIR: tuple[type[Effect], ...] = (
    ValveDelay,
    ValveCloseDelay,
    SupplyScale,
    SupplyDroop,
    RiseTimeScale,
    HoseLag,
    CrossLeak,
    BothModeLoss,
)
PISTON: tuple[type[Effect], ...] = (
    SealFriction,
    StribeckFriction,
    PressureFriction,
    PistonDamping,
    QuadraticDamping,
    EndCushion,
    GasSpring,
)
HIP: tuple[type[Effect], ...] = (
    HipFriction,
    HipDamping,
    TorqueScale,
    MotorLag,
    HipSpring,
    RotorInertia,
)
BODY: tuple[type[Effect], ...] = (
    Payload,
    ComOffset,
    BoomForce,
    BoomInertia,
    BoomFriction,
    BoomDamping,
    BoomSpring,
    PitchFriction,
)
GROUND: tuple[type[Effect], ...] = (GroundCompliance, GroundFriction)
SENSORS: tuple[type[Effect], ...] = (SensorBias, SensorScale, SensorDelay)

# what may be missing from a model: the candidates of identification
MISSING: tuple[type[Effect], ...] = (*AIR, *PISTON, *HIP, *BODY, *GROUND, *SENSORS)

EFFECTS: tuple[type[Effect], ...] = (*PLANNING, *PHYSICAL, *MISSING, Expression)

BY_KIND: dict[str, type[Effect]] = {e.model_fields["kind"].default: e for e in EFFECTS}

CHAMBERS: dict[str, Callable[[], list[Effect]]] = {
    "first_order": lambda: [Chamber(), ModeDamping()],
    "orifice": lambda: [OrificeChamber()],
}
