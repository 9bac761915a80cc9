"""The effects that kemba ships, by family, and the register of all effects by kind."""

from collections.abc import Callable, Mapping
from types import ModuleType

from kemba.effects import sensors
from kemba.effects.base import Deviation, Effect
from kemba.effects.expression import Expression
from kemba.effects.mechanics import boom, geometry, ground, hip, load, piston
from kemba.effects.pneumatics import gas, hose, supply, valve
from kemba.effects.pneumatics.chamber import Chamber, ModeDamping
from kemba.effects.pneumatics.orifice import OrificeChamber
from kemba.effects.registry import Registry
from kemba.effects.rigs import axis, friction
from kemba.effects.rigs.chambers import MeasuredChambers
from kemba.errors import KembaError

# the planning model's own physics
PLANNING: tuple[type[Effect], ...] = (
    *(valve.Valve, Chamber, ModeDamping, piston.EndStop, hip.Motor, boom.Boom, ground.Contact),
)

# the same air, seen closer
PHYSICAL: tuple[type[Effect], ...] = (OrificeChamber, supply.SupplyLine, gas.GasTemperature)

# what a rig of the user's own brings along
OWN_RIGS: tuple[type[Effect], ...] = (MeasuredChambers, axis.DriveAxis, gas.VesselChamber)


def _deviations(*modules: ModuleType) -> tuple[type[Effect], ...]:
    """The deviations that modules define, in their order."""
    found = [(m.__name__, item) for m in modules for item in vars(m).values()]
    return tuple(
        item
        for module, item in found
        if isinstance(item, type) and issubclass(item, Deviation) and item.__module__ == module
    )


# what may be missing from a model: the candidates of identification
DRIVE = _deviations(friction, axis)
SENSORS = tuple(e for e in _deviations(sensors) if e is not sensors.SensorEffect)
MISSING = (
    *_deviations(valve, supply, hose, gas, piston, hip, load, boom, ground, geometry),
    *DRIVE,
    *SENSORS,
)

EFFECTS: tuple[type[Effect], ...] = (*PLANNING, *PHYSICAL, *OWN_RIGS, *MISSING, Expression)

# these and the effects from outside, by kind
BY_KIND = Registry(EFFECTS)


def load_effects(files: Mapping[str, str]) -> None:
    """Load the files that another process has loaded (`BY_KIND.files`). For workers. Raises
    KembaError where a file cannot be loaded, or has another content here."""
    for path, digest in files.items():
        BY_KIND.load_file(path)
        if BY_KIND.files.get(path) != digest:
            raise KembaError(path, "has another content than where this work was asked for")


CHAMBERS: dict[str, Callable[[], list[Effect]]] = {
    "first_order": lambda: [Chamber(), ModeDamping()],
    "orifice": lambda: [OrificeChamber()],
}
