"""Sensor faults as identification names them: which may be there, and which are, at theta."""

from __future__ import annotations

from collections.abc import Iterable

from kemba.effects import BY_KIND
from kemba.effects.base import REMEASURED, Effect
from kemba.effects.sensors import SensorEffect, as_measured, as_true
from kemba.effects.series import Series
from kemba.identify.problem.problem import Theta


def fault_kinds() -> dict[str, type[SensorEffect]]:
    """Every kind of sensor fault in the catalogue."""
    return {k: e for k, e in BY_KIND.items() if issubclass(e, SensorEffect)}


def possible_faults(channel: str) -> dict[str, SensorEffect]:
    """One fault of every kind at a channel, switched off, by name."""
    found = (cls.model_validate({"channel": channel}) for cls in fault_kinds().values())
    return {fault.name: fault for fault in found}


class SensorFaults:
    """The faults of all sensors: those on a model's list, and those that theta adds.

    Names in theta are `sensor_bias:body/pitch.b`; a fault on the list keeps its value unless theta
    gives it another one.
    """

    def __init__(self, effects: Iterable[Effect] = ()) -> None:
        self.listed = {e.name: e for e in effects if isinstance(e, SensorEffect)}
        self._kinds = fault_kinds()  # asked for at every prediction

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
        return found

    def shown(self, theta: Theta, channel: str, true: Series) -> Series:
        """The channel as its sensor shows it at theta, from its true values."""
        return as_measured(self.at(theta, channel), channel, true)

    def behind(self, theta: Theta, channel: str, measured: Series) -> Series:
        """The true channel behind what its sensor shows, at theta."""
        return as_true(self.at(theta, channel), channel, measured)

    def lateness(self, theta: Theta, channel: str) -> float:
        """Seconds by which a channel's sensor is late at theta."""
        return sum(fault.lateness for fault in self.at(theta, channel))


def is_fault(name: str) -> bool:
    """Whether a name in theta is a figure of some sensor fault."""
    return name.partition(":")[0] in fault_kinds()


def is_straight(name: str) -> bool:
    """Whether a name in theta is a sensor fault's figure in which the reading is linear."""
    kind, _, rest = name.partition(":")
    cls = fault_kinds().get(kind)
    return cls is not None and cls.straight and rest.rpartition(".")[2] in cls.off
