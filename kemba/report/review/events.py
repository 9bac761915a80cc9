"""What happened when: apexes, lift-offs, touchdowns of each foot, and how the motion ended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from kemba.events import (
    EXECUTED,
    MEASURED,
    PLANNED,
    UPRIGHT,
    ContactCourse,
    Span,
    contacts,
    ends_standing,
    gap,
    read,
    turned,
)
from kemba.plotting import Machine
from kemba.plotting.robot.machine import EXACT
from kemba.report.review.tracks import Track
from kemba.trajectory import Trajectory

LOW = 0.05  # m; a body that ends so far below where it should has not landed on its feet


@dataclass(frozen=True)
class Events:
    """Of one motion: the highest point [s, m]; apexes of all flights [s, m]; how far the lower foot
    rises [m]; lift-offs of the last foot [s]; firm contacts and grazes by leg; and what is wrong
    with its end (`tips over`), None for nothing."""

    apex_time: float
    apex: float
    feet: float | None = None
    apexes: tuple[tuple[float, float], ...] = ()
    lift_offs: tuple[float, ...] = ()
    touchdowns: dict[str, list[float]] = field(default_factory=dict)
    grazes: dict[str, list[float]] = field(default_factory=dict)
    fault: str | None = None


def events_of(track: Track, machine: Machine, plan: Track | None = None) -> Events | None:
    """The events of a robot's motion; None where its height is not known."""
    t = track.t
    if "body/z" not in t or not np.isfinite(t["body/z"]).sum() > 2:
        return None
    course = _course(track, machine)
    first, flights = float(course.time[0]), course.flights
    tops = (course.apex(flight) for flight in flights)
    return Events(
        *course.top,
        _feet(t, machine),
        tuple(top for top in tops if top),
        tuple(flight.begin for flight in flights if flight.begin > first),
        {leg: course.touchdowns(leg=leg) for leg in course.contacts},
        {leg: [s.begin for s in spans if not s.firm] for leg, spans in course.contacts.items()},
        _fault(t, machine, plan.t if plan else None),
    )


def _course(track: Track, machine: Machine) -> ContactCourse:
    """Exact motions are read as they are judged; feet of measured ones by force and height."""
    t, legs = track.t, machine.mechanism.legs
    if t.meta.get("kind") in EXACT and all(f"{leg}/foot/z" in t for leg in legs):
        return read(t, PLANNED if track.source.plan else EXECUTED, machine.mechanism.weight)
    feet: dict[str, list[Span]] = {}
    for leg in legs:
        stands = machine.stance(t, leg)
        feet[leg] = contacts(t.time, np.where(stands, 0.0, 1.0), PLANNED)
    return ContactCourse(t, t.time, feet, MEASURED)


def _feet(t: Trajectory, machine: Machine) -> float | None:
    """How far [m] the lower foot rises."""
    feet = machine.feet(t)
    if feet is None:
        return None
    lower = np.min([gap(feet, leg) for leg in machine.mechanism.legs], axis=0)
    return float(np.nanmax(lower)) if np.isfinite(lower).any() else None


def _fault(t: Trajectory, machine: Machine, plan: Trajectory | None) -> str | None:
    """What is wrong at the end of a motion, or of its plan if that goes on moving there."""
    known = np.isfinite(t["body/z"])
    if plan is not None and not ends_standing(plan, machine.mechanism.legs):
        known &= t.time <= plan.time[-1]
    ground, x = machine.mechanism.scene.ground, t.get("body/x", np.zeros(len(t)))
    time, z = t.time[known], (t["body/z"] - ground.height(np.nan_to_num(x)))[known]
    if not len(z):
        return None
    if "body/pitch" in t:
        pitch = t["body/pitch"][np.isfinite(t["body/pitch"]) & (t.time <= time[-1])]
        if len(pitch) and turned(pitch[-1], plan["body/pitch"][-1] if plan else 0.0) > UPRIGHT:
            return "tips over"
    asked = z[0]
    if plan is not None:
        asked = plan["body/z"][-1] - float(ground.height(plan["body/x"][-1]))
    return "ends on the ground" if z[-1] < min(asked, z.max()) - LOW else None


def marks_of(listed: Sequence[Events | None]) -> list[tuple[float, int]]:
    """Touchdowns as vertical lines: time [s] and the number of the motion."""
    return [
        (round(time, 4), i)
        for i, events in enumerate(listed)
        if events
        for times in events.touchdowns.values()
        for time in times
    ]
