"""Unknown forces, and places that stand still, in the filter over robot logs.

Forces are white noise of a spectral density: variance times seconds, N2.s or N2.m2.s.
"""

from __future__ import annotations

import math

from kemba.settings import BY_HAND, Settings, setting


class ForceDensity(Settings):
    """Density of the forces that no model explains, by channel."""

    body: float = setting(5e-3, "N2.s", "force on the body", BY_HAND, decides=True)
    pitch: float = setting(2e-4, "N2.m2.s", "moment on the body", BY_HAND, decides=True)
    hip: float = setting(2e-4, "N2.m2.s", "torque at a hip", BY_HAND, decides=True)
    rod: float = setting(2e-2, "N2.s", "force on a rod", BY_HAND, decides=True)


class LooseForceDensity(ForceDensity):
    """The same while the motion is smoothed: the motion follows the data."""

    body: float = setting(0.05, "N2.s", "force on the body", BY_HAND)
    pitch: float = setting(2e-3, "N2.m2.s", "moment on the body", BY_HAND)
    hip: float = setting(2e-3, "N2.m2.s", "torque at a hip", BY_HAND)
    rod: float = setting(0.5, "N2.s", "force on a rod", BY_HAND)


class QuietForceDensity(ForceDensity):
    """The same while a missing force is estimated: all that is unknown belongs to it."""

    body: float = setting(1e-5, "N2.s", "force on the body", "convention: as good as none")
    pitch: float = setting(1e-6, "N2.m2.s", "moment on the body", "convention: as good as none")
    hip: float = setting(1e-6, "N2.m2.s", "torque at a hip", "convention: as good as none")
    rod: float = setting(1e-5, "N2.s", "force on a rod", "convention: as good as none")


class ContactForceSettings(Settings):
    """Density of forces that are unknown in contact."""

    contact: float = setting(300.0, "N2.s", "of a foot on the ground, a piston at a stop", BY_HAND)
    impact: float = setting(3e4, "N2.s", "of an impact", BY_HAND)
    slipping: float = setting(1.0, "N2.s", "of a sliding foot, beyond its friction", BY_HAND)
    stopped: float = setting(50.0, "N2.s", "of a rod, above which its force is a stop's", BY_HAND)
    edge: int = setting(8, "1", "nodes that an impact at a stop lasts", BY_HAND)
    air: float = setting(100.0, "N2.s", "of a rod where a log does not begin at rest", BY_HAND)
    air_fades: float = setting(0.025, "s", "time in which this fades", BY_HAND)
    rest: int = setting(5, "1", "node of a log that tells whether it begins at rest", BY_HAND)


class PlaceSettings(Settings):
    """Places that stand still: of feet on the ground, of pistons at their stops."""

    ground: float = setting(1e-4, "m", "noise of a standing foot's place", BY_HAND)
    ground_level: float = setting(2.5e-4, "m", "prior sigma of the ground's height", BY_HAND)
    ground_wander: float = setting(
        6e-5 / math.sqrt(0.02), "m.s-1/2", "wander of a standing foot", f"{BY_HAND}; 60 um in 20 ms"
    )
    stop: float = setting(1e-4, "m", "noise of a piston at its stop", BY_HAND)
    stop_wander: float = setting(
        1e-4 / math.sqrt(0.02), "m.s-1/2", "wander of a stop", f"{BY_HAND}; 0.1 mm in 20 ms"
    )
    unknown: float = setting(3.0, "m", "prior sigma of a place", "convention: no knowledge")
    free: float = setting(1.0, "m.s-1/2", "wander of a free foot's place", "convention: no hold")
    position: float = setting(
        0.03, "m, rad", "prior sigma of a deviation from the reference", "convention: no knowledge"
    )
    velocity: float = setting(
        3.0, "m.s-1, rad.s-1", "prior sigma of its rate", "convention: no knowledge"
    )
    thinnest: float = setting(
        0.5,
        "1",
        "smallest factor by which a yielding ground stiffens",
        "convention: stays positive",
    )


class KinematicSettings(Settings):
    """Smoothing of every coordinate for itself: density of its acceleration."""

    body_x: float = setting(30.0, "m2.s-3", "of the body along the rail", BY_HAND)
    body_z: float = setting(60.0, "m2.s-3", "of the body's height", BY_HAND)
    body_pitch: float = setting(300.0, "rad2.s-3", "of the body's pitch", BY_HAND)
    hip: float = setting(2e3, "rad2.s-3", "of a hip", BY_HAND)
    knee: float = setting(2e5, "rad2.s-3", "of a knee", BY_HAND)
    position: float = setting(10.0, "m, rad", "prior sigma of a start", "convention: no knowledge")
    velocity: float = setting(
        100.0, "m.s-1, rad.s-1", "prior sigma of its rate", "convention: no knowledge"
    )

    def density(self, coordinate: str) -> float:
        """Of the coordinate of this name."""
        known = {"body/x": self.body_x, "body/z": self.body_z, "body/pitch": self.body_pitch}
        return known.get(coordinate) or (self.hip if "hip" in coordinate else self.knee)
