"""A boom that is longer or shorter than the drawing says."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, ClassVar, Literal

from kemba.effects.base import At, Contribution, Effect
from kemba.effects.sensors import SensorEffect, SensorScale
from kemba.quantity import Param


class BoomLever(Effect):
    """Both levers of the boom are off by the share k, and so is what its encoders tell.

    Place and height of the body are the boom's angles times the drawn lever: a boom that is 2 %
    longer shows every way of the body 2 % too short. Its inertia and weight act at the true lever.
    """

    kind: Literal["boom_lever"] = "boom_lever"
    k: Annotated[float, Param("1", 0.02, lower=-0.2, upper=0.2, doc="true lever / drawn - 1")] = 0.0

    place: ClassVar[Literal["leg", "body"]] = "body"
    family: ClassVar[str] = "boom"
    equation: ClassVar[str] = (
        "l -> (1 + k) l in the boom's inertia and weight; measured x, z = true / (1 + k)"
    )
    source: ClassVar[str] = "lever arithmetic; paper II-B: x and z from the boom's encoders"
    ports: ClassVar[tuple[str, ...]] = ("body_x", "body_z")
    needs: ClassVar[tuple[str, ...]] = ("boom_mass_x", "boom_mass_z", "boom_weight")
    off: ClassVar[dict[str, float]] = {"k": 0.0}

    def readings(self) -> Iterable[SensorEffect]:
        shown = 1.0 / (1.0 + self.k) - 1.0
        return [SensorScale(channel=channel, k=shown) for channel in ("body/x", "body/z")]

    def evaluate(self, at: At) -> Contribution:
        less = 1 / (1 + self.k)
        inertia, weight = less**2 - 1, less - 1
        return Contribution(
            effort={
                "body_x": -inertia * at.boom_mass_x * at.body_x.a,
                "body_z": -inertia * at.boom_mass_z * at.body_z.a - weight * at.boom_weight,
            }
        )
