"""The model of a rig of the user's own: what the rig brings along, and the effects listed."""

from __future__ import annotations

import math
from collections.abc import Iterable

from kemba.effects.base import Effect
from kemba.effects.pneumatics.gas import VesselChamber
from kemba.effects.rigs.axis import DriveAxis
from kemba.effects.rigs.chambers import MeasuredChambers
from kemba.mechanism import CylinderRig, DriveRig, VesselRig, own_mechanism
from kemba.model.model import Model


def own_model(
    rig: CylinderRig | DriveRig | VesselRig, effects: Iterable[Effect] = (), name: str = "rig"
) -> Model:
    """The rig with its own physics and `effects`; one of the same name replaces it."""
    listed = {e.name: e for e in (brought_along(rig), *effects)}
    return Model(own_mechanism(rig), listed.values(), name=name)


def brought_along(rig: CylinderRig | DriveRig | VesselRig) -> Effect:
    """The physics that every rig of this kind has."""
    if isinstance(rig, CylinderRig):
        return MeasuredChambers(chambers=rig.chambers, travel=rig.stretch)
    if isinstance(rig, DriveRig):
        load, arm = (rig.load.mass, rig.load.arm) if rig.load else (0.0, None)
        return DriveAxis(J=rig.inertia, m=load, arm=arm or 0.0, hangs=arm is not None)
    opening = math.pi / 4 * rig.orifice**2 * rig.discharge
    figures = {"ambient": rig.ambient, "outside": rig.outside}
    return VesselChamber(V=rig.volume, a=opening, wall=rig.area, **figures)
