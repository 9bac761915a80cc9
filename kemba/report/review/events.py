"""What happened when: apex, lift-off, touchdown of each foot, and how the motion ended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kemba.plant.execution.replay import LandingSettings, peak
from kemba.plotting import Machine, Source
from kemba.plotting.source import Mask
from kemba.report.review.tracks import Track
from kemba.settings import CHOSEN, Settings, setting
from kemba.trajectory import Array, Trajectory


class EventSettings(Settings):
    """How the end of a motion is judged."""

    low: float = setting(
        0.05, "m", "a body that ends so far below its start has not landed on its feet", CHOSEN
    )


@dataclass(frozen=True)
class FootFlight:
    """Of one foot around the apex: when it left and when it came down again [s], None where it did
    not; `grazes`: when it touched the ground for a moment on its way."""

    left: float | None
    landed: float | None
    grazes: tuple[float, ...] = ()


@dataclass(frozen=True)
class Events:
    """Of one motion: apex [s, m], how far the lower foot rises [m], flight by leg, and what is
    wrong with its end (`tips over`), None for nothing."""

    apex_time: float
    apex: float
    feet: float | None
    flights: dict[str, FootFlight]
    fault: str | None

    @property
    def lift_off(self) -> float | None:
        """When [s] the last foot left the ground."""
        left = [flight.left for flight in self.flights.values()]
        known = [time for time in left if time is not None]
        return max(known) if known and len(known) == len(left) else None


def events_of(track: Track, machine: Machine) -> Events | None:
    """The events of a robot's motion; None where its height is not known."""
    t = track.t
    if "body/z" not in t or not np.isfinite(t["body/z"]).sum() > 2:
        return None
    known = np.isfinite(t["body/z"])
    time, z = peak(t.time[known], _calm(t.time[known], t["body/z"][known]))
    legs = machine.mechanism.legs
    flights = {leg: _flight(track.source, machine.stance(t, leg), time) for leg in legs}
    return Events(time, z, _feet(t, machine), flights, _fault(t, z, machine))


def _flight(source: Source, stands: Mask, apex: float) -> FootFlight:
    """The contacts around the apex; one that is shorter than a touchdown grazes."""
    spans, time = source.spans(stands), source.trajectory.time
    ends = float(time[0]), float(time[-1])
    lasts = LandingSettings.current().lasts
    firm = [(a, b) for a, b in spans if b - a >= lasts or a <= ends[0] or b >= ends[1]]
    if any(a <= apex <= b for a, b in firm):
        return FootFlight(None, None)
    left = [float(b) for a, b in firm if a < apex and b < ends[1]]
    down = [float(a) for a, _ in firm if a > apex]
    first, last = left[-1] if left else None, down[0] if down else None
    short = [float(a) for a, b in spans if (a, b) not in firm]
    during = [a for a in short if (first or ends[0]) < a < (last or ends[1])]
    return FootFlight(first, last, tuple(during))


def _feet(t: Trajectory, machine: Machine) -> float | None:
    """How far [m] the lower foot rises above the ground."""
    feet = [machine.height(t, leg) for leg in machine.mechanism.legs]
    known = [height for height in feet if height is not None]
    if len(known) < len(feet):
        return None
    lower = np.min(known, axis=0)
    return float(np.nanmax(lower)) if np.isfinite(lower).any() else None


def _fault(t: Trajectory, apex: float, machine: Machine) -> str | None:
    x = t.get("body/x", np.zeros(len(t)))
    z = t["body/z"] - machine.mechanism.scene.ground.height(np.nan_to_num(x))
    z = z[np.isfinite(z)]
    if "body/pitch" in t:
        pitch = t["body/pitch"][np.isfinite(t["body/pitch"])]
        if len(pitch) and abs(pitch[-1]) > LandingSettings.current().upright:
            return "tips over"
    low = EventSettings.current().low
    return "ends on the ground" if z[-1] < z[0] - low and z[-1] < apex - low else None


def _calm(time: Array, values: Array) -> Array:
    """Values whose noise is averaged over 5 ms, so that the peak is not the largest error."""
    width = max(1, round(5e-3 / float(np.median(np.diff(time)))))
    if width < 3:
        return values
    padded = np.pad(values, width // 2, mode="edge")
    return np.convolve(padded, np.full(width, 1 / width), mode="valid")[: len(values)]


def marks_of(listed: Sequence[Events | None]) -> list[tuple[float, int]]:
    """Touchdowns as vertical lines: time [s] and the number of the motion."""
    return [
        (round(flight.landed, 4), i)
        for i, events in enumerate(listed)
        if events
        for flight in events.flights.values()
        if flight.landed is not None
    ]
