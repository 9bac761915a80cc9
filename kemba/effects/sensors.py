"""What sensors do to a channel on its way into a log; never part of the motion."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import field_validator, model_validator

from kemba.effects.base import Effect
from kemba.quantity import Param, to_si

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
}


class SensorEffect(Effect):
    """A fault of one sensor. `channel` is a column without its unit: `body/pitch`."""

    channel: str

    place: ClassVar[Literal["leg", "body"]] = "body"
    family: ClassVar[str] = "sensors"
    moves: ClassVar[bool] = False
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
        """Usual noise of such a channel (1 sigma); what is learnt from a log is better."""
        return CHANNELS[self.channel.split("/")[-1]][1]

    def measured(self, time: Any, true: Any) -> Any:
        """The channel as the log shows it, from its true values (n,) at `time` (n,) [s]."""
        raise NotImplementedError

    def expanded(self, true: Any, rate: Any) -> Any:
        """The measured value to first order in the parameters, from the true value and its time
        derivative; parameters and arguments may be symbols."""
        raise NotImplementedError


class SensorBias(SensorEffect):
    """A constant offset: a zero that was set wrongly. Does not enter the motion."""

    kind: Literal["sensor_bias"] = "sensor_bias"
    b: Annotated[float, Param("1", 5.0, doc="offset in the channel's unit; size 5 sigma")] = 0.0

    equation: ClassVar[str] = "measured = true + b"
    source: ClassVar[str] = "encoder and transducer zeros"
    off: ClassVar[dict[str, float]] = {"b": 0.0}
    in_channel_unit: ClassVar[tuple[str, ...]] = ("b",)

    @model_validator(mode="before")
    @classmethod
    def _in_channel_unit(cls, data: Any) -> Any:
        if not isinstance(data, dict) or not isinstance(data.get("b"), str):
            return data
        unit, _ = CHANNELS.get(str(data.get("channel")).split(" [")[0].split("/")[-1], ("1", 1.0))
        return {**data, "b": to_si(data["b"], unit)}

    def parameters(self) -> dict[str, Param]:
        doc = self.declared()["b"].doc
        return {"b": Param(self.unit, 5.0 * self.sigma, doc=doc)}

    def measured(self, time: Any, true: Any) -> Any:
        return true + self.b

    def expanded(self, true: Any, rate: Any) -> Any:
        return true + self.b


class SensorScale(SensorEffect):
    """A wrong gain: lever arm, encoder counts, transducer sensitivity. Not in the motion."""

    kind: Literal["sensor_scale"] = "sensor_scale"
    k: Annotated[float, Param("1", 0.02, doc="relative error of the gain")] = 0.0

    equation: ClassVar[str] = "measured = (1 + k) true"
    source: ClassVar[str] = "calibration of encoders and transducers"
    off: ClassVar[dict[str, float]] = {"k": 0.0}

    def measured(self, time: Any, true: Any) -> Any:
        return (1 + self.k) * true

    def expanded(self, true: Any, rate: Any) -> Any:
        return (1 + self.k) * true


class SensorDelay(SensorEffect):
    """The channel comes later than the others: filters, bus. Does not enter the motion."""

    kind: Literal["sensor_delay"] = "sensor_delay"
    dt: Annotated[float, Param("s", 0.003, doc="delay")] = 0.0

    equation: ClassVar[str] = "measured(t) = true(t - dt)"
    source: ClassVar[str] = "filters and bus transport"
    off: ClassVar[dict[str, float]] = {"dt": 0.0}

    def measured(self, time: Any, true: Any) -> Any:
        return np.interp(np.asarray(time) - self.dt, time, true)

    def expanded(self, true: Any, rate: Any) -> Any:
        return true - self.dt * rate


def as_measured(effects: Iterable[Effect], channel: str, time: Any, true: Any) -> Any:
    """A channel (a column without its unit) with all its faults: late, then scaled, then offset."""
    order = (SensorDelay, SensorScale, SensorBias)
    faults = [e for e in effects if isinstance(e, SensorEffect) and e.channel == channel]
    for fault in sorted(faults, key=lambda e: order.index(type(e))):
        true = fault.measured(time, true)
    return true
