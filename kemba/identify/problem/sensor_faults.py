"""Sensor faults as identification names them: which may be there, and which are, at theta."""

from collections.abc import Iterable

from kemba.effects import BY_KIND
from kemba.effects.base import REMEASURED, Effect
from kemba.effects.sensors import SensorEffect, as_measured, as_true
from kemba.effects.series import Series
from kemba.identify.problem.problem import Theta

GEOMETRY = "geometry:"  # names of the lengths begin so


def _fault_kinds() -> dict[str, type[SensorEffect]]:
    """Every kind of sensor fault in the catalogue."""
    return {k: e for k, e in BY_KIND.items() if issubclass(e, SensorEffect)}


def possible_faults(channel: str) -> dict[str, SensorEffect]:
    """One fault of every kind at a channel, switched off, by name."""
    found = (cls.model_validate({"channel": channel}) for cls in _fault_kinds().values())
    return {fault.name: fault for fault in found}


def _carriers() -> dict[str, type[Effect]]:
    """Other kinds of effects that make sensors wrong, such as a boom's lever."""
    own = (Effect.readings, SensorEffect.readings)
    return {k: e for k, e in BY_KIND.items() if e.readings not in own}


class SensorFaults:
    """The faults of all sensors: those on a model's list, and those that theta adds.

    Names in theta are `sensor_bias:body/pitch.b`; a fault on the list keeps its value unless theta
    gives it another one.
    """

    def __init__(self, effects: Iterable[Effect] = ()) -> None:
        effects = list(effects)
        self.listed = {e.name: e for e in effects if isinstance(e, SensorEffect)}
        self._kinds, self._carriers = _fault_kinds(), _carriers()  # asked for at every prediction
        self.carried = {e.name: e for e in effects if e.kind in self._carriers}

    @property
    def present(self) -> bool:
        """Whether the model lists anything that makes a sensor wrong."""
        return bool(self.listed or self.carried)

    @property
    def nuisance(self) -> dict[str, tuple[float, float]]:
        """Nominal value and 1 sigma of the listed faults' figures, by their name in theta."""
        share = REMEASURED.share(1.0)
        values = {
            f"{name}.{figure}": float(fault.value(figure))
            for name, fault in self.listed.items()
            for figure in fault.off
        }
        return {name: (value, share * abs(value)) for name, value in values.items() if value}

    def at(self, theta: Theta, channel: str) -> list[SensorEffect]:
        """The faults of a channel at theta."""
        found = []
        for kind, cls in self._kinds.items():
            name = f"{kind}:{channel}"
            own = {figure: theta.get(f"{name}.{figure}") for figure in cls.declared()}
            values = {figure: value for figure, value in own.items() if value is not None}
            fault = self.listed.get(name)
            if fault is None and any(figure in values for figure in cls.off):
                fault = cls.model_validate({"channel": channel})
            if fault is not None:
                found.append(fault.model_copy(update=values))
        carrying = dict(self.carried)  # effects that bring faults of sensors along
        for kind, effect in self._carriers.items():
            own = {f: theta[f"{kind}.{f}"] for f in effect.declared() if f"{kind}.{f}" in theta}
            if own:
                plain = carrying.get(kind) or effect.model_validate({"kind": kind})
                carrying[kind] = plain.bind(own)
        brought = (f for effect in carrying.values() for f in effect.readings())
        return [*found, *(fault for fault in brought if fault.channel == channel)]

    def shown(self, theta: Theta, channel: str, true: Series) -> Series:
        """The channel as its sensor shows it at theta, from its true values."""
        return as_measured(self.at(theta, channel), channel, true)

    def scaled(self, theta: Theta, channel: str, read: Series) -> Series:
        """The channel as its sensor shows it, from the values at the times that it shows."""
        return as_measured([f for f in self.at(theta, channel) if not f.lateness], channel, read)

    def behind(self, theta: Theta, channel: str, measured: Series) -> Series:
        """The true channel behind what its sensor shows, at theta."""
        return as_true(self.at(theta, channel), channel, measured)

    def lateness(self, theta: Theta, channel: str) -> float:
        """Seconds by which a channel's sensor is late at theta."""
        return sum(fault.lateness for fault in self.at(theta, channel))


def is_fault(name: str) -> bool:
    """Whether a name in theta is a figure that changes what some sensor shows."""
    found = BY_KIND.get(name.partition(":")[0].partition(".")[0])
    return found is not None and found.readings is not Effect.readings


def moves_readings(name: str) -> bool:
    """Whether a name in theta is a figure that a drift of sensors may imitate: what they show, or a
    length between them."""
    return is_fault(name) or name.startswith(GEOMETRY)


def is_straight(name: str) -> bool:
    """Whether a name in theta is a sensor fault's figure in which the reading is linear."""
    kind, _, rest = name.partition(":")
    found = BY_KIND.get(kind)
    fault = found if found and issubclass(found, SensorEffect) else None
    return fault is not None and fault.straight and rest.rpartition(".")[2] in fault.off
