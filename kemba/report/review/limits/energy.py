"""Energy of a jump: what pistons and hips put in and take out, and what impacts take."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kemba.effects.pneumatics.constants import ATMOSPHERE
from kemba.mechanism import Cylinder
from kemba.report.review.limits.use import air_drawn, pressure, rate
from kemba.report.review.tracks import Track
from kemba.trajectory import Array


@dataclass(frozen=True)
class Energy:
    """Work (rows,) [J] since the start of the pistons and of the hips; energy that impacts take
    [J], air drawn from the supply [kg]. None where it is not known."""

    pistons: Array | None
    hips: Array | None
    impacts: float | None
    drawn: float | None


def energy_of(
    track: Track, legs: Sequence[str], cylinder: Cylinder, certificate: Mapping[str, Any]
) -> Energy:
    """The energy of one motion."""
    listed = track.t.meta.get("impacts")
    if track.role == "plan":
        listed = certificate.get("impacts")
    drawn = [air_drawn(track, leg, cylinder) for leg in legs]
    return Energy(
        _summed([_piston_power(track, leg, cylinder) for leg in legs], track),
        _summed([_hip_power(track, leg) for leg in legs], track),
        sum(float(i["energy_J"]) for i in listed) if listed is not None else None,
        sum(one or 0.0 for one in drawn) if any(one is not None for one in drawn) else None,
    )


def _piston_power(track: Track, leg: str, cylinder: Cylinder) -> Array | None:
    """Of the force on the rod where it is known, else of the air alone."""
    t = track.t
    push, pull = (pressure(t, leg, side, cylinder) for side in ("extend", "retract"))
    speed = rate(track, f"{leg}/piston/v", f"{leg}/piston/x")
    if f"{leg}/piston/F" in t:
        return np.asarray(t[f"{leg}/piston/F"] * speed)
    if push is None or pull is None or not np.isfinite(speed).any():
        return None
    force = cylinder.area_extend * (push - ATMOSPHERE)
    return np.asarray((force - cylinder.area_retract * (pull - ATMOSPHERE)) * speed)


def _hip_power(track: Track, leg: str) -> Array | None:
    if f"{leg}/hip/tau" not in track.t:
        return None
    return np.asarray(track.t[f"{leg}/hip/tau"] * rate(track, f"{leg}/hip/w", f"{leg}/hip/q"))


def _summed(powers: Sequence[Array | None], track: Track) -> Array | None:
    """Work (rows,) of all legs since the start."""
    if any(power is None for power in powers):
        return None
    total = np.nan_to_num(np.sum([power for power in powers if power is not None], axis=0))
    steps = np.diff(track.t.time) * 0.5 * (total[1:] + total[:-1])
    return np.concatenate([[0.0], np.cumsum(steps)])


def put_in(work: Array | None) -> tuple[float, float] | None:
    """Energy [J] put in, and taken out again."""
    if work is None:
        return None
    steps = np.diff(work)
    return float(steps[steps > 0].sum()), float(-steps[steps < 0].sum())
