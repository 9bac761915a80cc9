"""What sensors do to a channel on its way into a log; never part of the motion.

Simulator, bench and robot identification all read the faults from here. A new fault is one class:
it says what is measured of a true series, how to undo that, and at which stage of the sensor it
acts (`stage`). Faults of one channel always act in the order of the stages: first the clock (the
reading is late), then the gain, then the zero, in whatever order a model lists them.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Any, ClassVar, Literal

from pydantic import field_validator, model_validator

from kemba.effects.base import Deviation, Effect
from kemba.effects.series import Series
from kemba.quantity import Param, to_si

STAGES = ("clock", "gain", "zero")  # of a sensor, in the order in which a signal passes them

# unit and usual noise (1 sigma) of a channel by the last part of its name
CHANNELS: dict[str, tuple[str, float]] = {
    "x": ("m", 3e-4),
    "z": ("m", 3e-4),
    "pitch": ("rad", 1e-3),
    "q": ("rad", 1e-3),
    "w": ("rad.s-1", 0.05),
    "pitch_rate": ("rad.s-1", 0.02),
    "v": ("m.s-1", 0.01),
    "vx": ("m.s-1", 0.01),
    "vz": ("m.s-1", 0.01),
    "ax": ("m.s-2", 0.3),
    "az": ("m.s-2", 0.3),
    "tau": ("N.m", 0.05),
    "F": ("N", 1.0),
    "Fx": ("N", 2.0),
    "Fz": ("N", 2.0),
    "P": ("Pa", 2e3),
    "T": ("K", 0.5),
}


class SensorEffect(Deviation):
    """A fault of one sensor. `channel` is a column without its unit: `body/pitch`.

    `off` names the parameter that switches it. `straight`: what is measured is linear in that
    parameter, so that a finite difference of any size is its derivative.
    """

    channel: str

    place = "body"
    family = "sensors"
    moves = False
    stage: ClassVar[Literal["clock", "gain", "zero"]]
    straight: ClassVar[bool] = True
    in_channel_unit: ClassVar[tuple[str, ...]] = ()

    @field_validator("channel")
    @classmethod
    def _known(cls, channel: str) -> str:
        path = channel.split(" [")[0]
        if path.split("/")[-1] not in CHANNELS:
            endings = ", ".join(CHANNELS)
            raise ValueError(
                f"'{channel}' is not a measured channel; a column such as body/pitch or "
                f"<leg>/piston/x was expected (ending in one of: {endings})"
            )
        return path

    @field_validator("on")
    @classmethod
    def _one_leg(cls, on: str | None) -> str | None:
        if on is not None:
            raise ValueError("a sensor is chosen by `channel`, such as <leg>/piston/x, not by `on`")
        return on

    @property
    def name(self) -> str:
        return f"{self.kind}:{self.channel}"

    @property
    def unit(self) -> str:
        """Unit of the channel."""
        return CHANNELS[self.channel.split("/")[-1]][0]

    @property
    def sigma(self) -> float:
        """Usual noise of such a channel (1 sigma); an estimate from a log is better."""
        return CHANNELS[self.channel.split("/")[-1]][1]

    def sized(self, sigma: float) -> dict[str, Param]:
        """Parameters by name, with the sizes that matter at this noise of the channel (1 sigma)."""
        return self.declared()

    def parameters(self) -> dict[str, Param]:
        return self.sized(self.sigma)

    def readings(self) -> Iterable[SensorEffect]:
        return (self,)

    @property
    def lateness(self) -> float:
        """Seconds by which the sensor shows its channel late."""
        return 0.0

    def measured(self, true: Series) -> Series:
        """The channel as the sensor shows it, from its true values.

        The base class raises NotImplementedError.
        """
        raise NotImplementedError

    def undone(self, measured: Series) -> Series:
        """The true channel, from what the sensor shows: the inverse of `measured`.

        The base class raises NotImplementedError.
        """
        raise NotImplementedError


class SensorBias(SensorEffect):
    """A constant offset: a zero that was set wrongly. Does not enter the motion."""

    b: Annotated[float, Param("1", 5.0, doc="offset in the channel's unit; size 5 sigma")] = 0.0

    equation = "measured = true + b"
    source = "encoder and transducer zeros"
    stage = "zero"
    in_channel_unit = ("b",)

    @model_validator(mode="before")
    @classmethod
    def _in_channel_unit(cls, data: Any) -> Any:
        if not isinstance(data, dict) or not isinstance(data.get("b"), str):
            return data
        unit, _ = CHANNELS.get(str(data.get("channel")).split(" [")[0].split("/")[-1], ("1", 1.0))
        return {**data, "b": to_si(data["b"], unit)}

    def sized(self, sigma: float) -> dict[str, Param]:
        in_sigmas = self.declared()["b"]
        return {"b": Param(self.unit, in_sigmas.size * sigma, doc=in_sigmas.doc)}

    def measured(self, true: Series) -> Series:
        return true.plus(self.b)

    def undone(self, measured: Series) -> Series:
        return measured.plus(-self.b)


class SensorScale(SensorEffect):
    """A wrong gain: lever arm, encoder counts, transducer sensitivity. Not in the motion."""

    k: Annotated[float, Param("1", 0.02, doc="relative error of the gain")] = 0.0

    equation = "measured = (1 + k) true"
    source = "calibration of encoders and transducers"
    stage = "gain"

    def measured(self, true: Series) -> Series:
        return true.times(1 + self.k)

    def undone(self, measured: Series) -> Series:
        return measured.times(1 / (1 + self.k))


class SensorDelay(SensorEffect):
    """The channel comes later than the others: filters, bus. Does not enter the motion."""

    dt: Annotated[float, Param("s", 0.003, doc="delay")] = 0.0

    equation = "measured(t) = true(t - dt)"
    source = "filters and bus transport"
    stage = "clock"
    straight = False

    @property
    def lateness(self) -> float:
        return self.dt

    def measured(self, true: Series) -> Series:
        return true.late(self.lateness)

    def undone(self, measured: Series) -> Series:
        return measured.late(-self.lateness)


def in_order(effects: Iterable[Effect], channel: str) -> list[SensorEffect]:
    """The faults of a channel (a column without its unit) in the order in which they act; those
    that another effect brings along, too."""
    faults = [fault for e in effects for fault in e.readings() if fault.channel == channel]
    return sorted(faults, key=lambda fault: (STAGES.index(fault.stage), fault.kind))


def as_measured(effects: Iterable[Effect], channel: str, true: Series) -> Series:
    """A channel as its sensor shows it, with all faults of that channel among `effects`."""
    for fault in in_order(effects, channel):
        true = fault.measured(true)
    return true


def as_true(effects: Iterable[Effect], channel: str, measured: Series) -> Series:
    """The true channel behind what its sensor shows: `as_measured` undone."""
    for fault in reversed(in_order(effects, channel)):
        measured = fault.undone(measured)
    return measured
