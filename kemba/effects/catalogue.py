"""The effects that kemba ships, by family, and the register of all effects by kind."""

from __future__ import annotations

from collections.abc import Callable, Mapping

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
from kemba.effects.mechanics.boom_lever import BoomLever
from kemba.effects.mechanics.contact import Contact
from kemba.effects.mechanics.friction import (
    DirectionFriction,
    PressureFriction,
    SealFriction,
    StribeckFriction,
)
from kemba.effects.mechanics.geometry import Geometry
from kemba.effects.mechanics.ground import GroundCompliance, GroundFriction
from kemba.effects.mechanics.hip import (
    HipDamping,
    HipFriction,
    HipSpring,
    MotorLag,
    RotorInertia,
    TorqueScale,
)
from kemba.effects.mechanics.load import ComOffset, MassSplit, Payload
from kemba.effects.mechanics.motor import Motor
from kemba.effects.mechanics.piston import EndCushion, GasSpring, PistonDamping, QuadraticDamping
from kemba.effects.mechanics.stops import EndStop
from kemba.effects.pneumatics.chamber import Chamber
from kemba.effects.pneumatics.damping import ModeDamping
from kemba.effects.pneumatics.gas import GasTemperature, VesselChamber, WallHeat
from kemba.effects.pneumatics.hose import BothModeLoss, CrossLeak, HoseLag
from kemba.effects.pneumatics.orifice import OrificeChamber
from kemba.effects.pneumatics.supply import RiseTimeScale, SupplyDroop, SupplyScale
from kemba.effects.pneumatics.supply_line import SupplyLine
from kemba.effects.pneumatics.timing import ValveCloseDelay, ValveDelay
from kemba.effects.pneumatics.valve import Valve
from kemba.effects.registry import Registry
from kemba.effects.rigs.axis import AxisLag, AxisOffset, AxisScale, Cogging, DriveAxis, ExtraInertia
from kemba.effects.rigs.chambers import MeasuredChambers
from kemba.effects.rigs.friction import (
    AxisDamping,
    AxisDirection,
    AxisFriction,
    AxisOneWay,
    AxisStribeck,
    GearFriction,
    Presliding,
)
from kemba.effects.sensors import SensorBias, SensorDelay, SensorScale
from kemba.errors import KembaError

# the planning model's own physics
PLANNING: tuple[type[Effect], ...] = (Valve, Chamber, ModeDamping, EndStop, Motor, Boom, Contact)

# the same air, seen closer
PHYSICAL: tuple[type[Effect], ...] = (OrificeChamber, SupplyLine, GasTemperature)

# what a rig of the user's own brings along
OWN_RIGS: tuple[type[Effect], ...] = (MeasuredChambers, DriveAxis, VesselChamber)

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
    WallHeat,
)
PISTON: tuple[type[Effect], ...] = (
    SealFriction,
    StribeckFriction,
    PressureFriction,
    DirectionFriction,
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
    MassSplit,
    BoomLever,
    BoomForce,
    BoomInertia,
    BoomFriction,
    BoomDamping,
    BoomSpring,
    PitchFriction,
)
GROUND: tuple[type[Effect], ...] = (GroundCompliance, GroundFriction)
DRIVE: tuple[type[Effect], ...] = (
    AxisFriction,
    AxisDamping,
    AxisDirection,
    AxisOneWay,
    AxisStribeck,
    GearFriction,
    Presliding,
    Cogging,
    AxisOffset,
    AxisScale,
    AxisLag,
    ExtraInertia,
)
GEOMETRY: tuple[type[Effect], ...] = (Geometry,)
SENSORS: tuple[type[Effect], ...] = (SensorBias, SensorScale, SensorDelay)

# what may be missing from a model: the candidates of identification
MISSING: tuple[type[Effect], ...] = (
    *AIR,
    *PISTON,
    *HIP,
    *BODY,
    *GROUND,
    *GEOMETRY,
    *DRIVE,
    *SENSORS,
)

EFFECTS: tuple[type[Effect], ...] = (*PLANNING, *PHYSICAL, *OWN_RIGS, *MISSING, Expression)

# these and the effects from outside, by kind
BY_KIND = Registry(EFFECTS)


def load_effects(files: Mapping[str, str]) -> None:
    """Load the files that another process has loaded (`BY_KIND.files`). For workers.

    Raises KembaError where a file cannot be loaded, or has another content here.
    """
    for path, digest in files.items():
        BY_KIND.load_file(path)
        if BY_KIND.files.get(path) != digest:
            raise KembaError(path, "has another content than where this work was asked for")


CHAMBERS: dict[str, Callable[[], list[Effect]]] = {
    "first_order": lambda: [Chamber(), ModeDamping()],
    "orifice": lambda: [OrificeChamber()],
}
