"""Unknown forces, and places that stand still, in the filter over robot logs.

Forces are white noise of a spectral density: variance times seconds, N2.s or N2.m2.s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class ForceDensity:
    """Density of the forces that no model explains: force on the `body` [N2.s], moment on it
    (`pitch`) and torque at a `hip` [N2.m2.s], force on a `rod` [N2.s]."""

    body: float = 5e-3
    pitch: float = 2e-4
    hip: float = 2e-4
    rod: float = 2e-2


LOOSE = ForceDensity(0.05, 2e-3, 2e-3, 0.5)  # while the motion is smoothed: it follows the data
QUIET = ForceDensity(1e-5, 1e-6, 1e-6, 1e-5)  # as good as none: all that is unknown is missing


class ContactForceSettings:
    """Density of forces that are unknown in contact."""

    contact = 300.0  # of a foot on the ground, a piston at a stop [N2.s]
    impact = 3e4  # of an impact [N2.s]
    slipping = 1.0  # of a sliding foot, beyond its friction [N2.s]
    stopped = 50.0  # of a rod, above which its force is a stop's [N2.s]
    edge = 8  # nodes that an impact at a stop lasts
    air = 100.0  # of a rod where a log does not begin at rest [N2.s]
    air_fades = 0.025  # time in which this fades [s]
    rest = 5  # node of a log that tells whether it begins at rest


class PlaceSettings:
    """Places that stand still: of feet on the ground, of pistons at their stops."""

    ground = 1e-4  # noise of a standing foot's place [m]
    ground_level = 2.5e-4  # prior sigma of the ground's height [m]
    ground_wander = 6e-5 / math.sqrt(0.02)  # wander of a standing foot [m.s-1/2]: 60 um in 20 ms
    stop = 1e-4  # noise of a piston at its stop [m]
    stop_wander = 1e-4 / math.sqrt(0.02)  # wander of a stop [m.s-1/2]: 0.1 mm in 20 ms
    unknown = 3.0  # prior sigma of a place [m]: no knowledge
    free = 1.0  # wander of a free foot's place [m.s-1/2]: no hold
    position = 0.03  # prior sigma of a deviation from the reference [m, rad]: no knowledge
    velocity = 3.0  # prior sigma of its rate [m.s-1, rad.s-1]: no knowledge
    thinnest = 0.5  # smallest factor by which a yielding ground stiffens: stays positive


class KinematicSettings:
    """Smoothing of every coordinate for itself: density of its acceleration."""

    body_x = 30.0  # of the body along the rail [m2.s-3]
    body_z = 60.0  # of the body's height [m2.s-3]
    body_pitch = 300.0  # of the body's pitch [rad2.s-3]
    hip = 2e3  # of a hip [rad2.s-3]
    knee = 2e5  # of a knee [rad2.s-3]
    position = 10.0  # prior sigma of a start [m, rad]: no knowledge
    velocity = 100.0  # prior sigma of its rate [m.s-1, rad.s-1]: no knowledge

    @classmethod
    def density(cls, coordinate: str) -> float:
        """Of the coordinate of this name."""
        known = {"body/x": cls.body_x, "body/z": cls.body_z, "body/pitch": cls.body_pitch}
        return known.get(coordinate) or (cls.hip if "hip" in coordinate else cls.knee)
