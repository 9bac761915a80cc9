"""Motions in the review: what happens when, plan and logs over each other."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from kemba.events import UPRIGHT, ends_standing, gap, turned
from kemba.plotting.source import Machine, stance_spans
from kemba.report.charts import Book, Chart, Curve, Spans, Track, on_grid, plan_of
from kemba.trajectory import Trajectory

DEGREES = 180.0 / np.pi


@dataclass(frozen=True)
class Shown:
    """A quantity on the page: its column, title, unit and factor from SI. `least`, `error_least`:
    smallest span of its axis and of that of its error, so that noise and rounding are not
    magnified."""

    name: str
    title: str
    unit: str
    factor: float = 1.0
    least: float = 0.0
    error_least: float = 0.0
    steps: bool = False
    level: str = ""

    @property
    def error(self) -> tuple[str, float]:
        """Unit of its error and factor from SI: lengths in metres are off by millimetres."""
        return ("mm", 1e3) if self.unit == "m" else (self.unit, self.factor)


BODY = (
    Shown("body/z", "Height of the body's centre", "m", 1.0, 0.05, 1.0),
    Shown("body/x", "Body forward", "m", 1.0, 0.05, 1.0),
    Shown("body/pitch", "Pitch, nose up", "deg", DEGREES, 4.0, 0.2),
)
JOINTS = (
    Shown("hip/q", "hip angle", "deg", DEGREES, error_least=0.2),
    Shown("piston/x", "piston extension", "mm", 1e3, error_least=1.0, level="piston/x"),
)
FORCES = (
    Shown("hip/tau", "hip torque", "N.m", error_least=0.2, steps=True, level="hip/tau"),
    Shown("chamber/extend/P", "pressure of the extend chamber", "bar", 1e-5),
    Shown("chamber/retract/P", "pressure of the retract chamber", "bar", 1e-5),
    Shown("piston/F", "force of the piston rod", "N"),
    Shown("foot/Fz", "ground force, upward", "N"),
    Shown("foot/Fx", "ground force, along", "N"),
)
RIG = (
    Shown("piston/x", "Piston extension", "mm", 1e3, least=1.0),
    Shown("piston/v", "Piston speed", "m/s", least=0.01),
    Shown("piston/F", "Force of the piston rod", "N", least=1.0),
    Shown("chamber/extend/P", "Pressure of the extend chamber", "bar", 1e-5, 0.1),
    Shown("chamber/retract/P", "Pressure of the retract chamber", "bar", 1e-5, 0.1),
)
NO_FORCE_ERROR = ("foot/Fz", "foot/Fx")  # a touchdown some ms late would fill the chart


def body_charts(book: Book, machine: Machine) -> str:
    """The body's coordinates."""
    stands = _stands(book.tracks, machine, "body")
    figures = (book.add(*_pair(book, q, q.name, q.title, stands)) for q in BODY)
    return f'<div class="grid">{"".join(figures)}</div>'


def leg_charts(book: Book, machine: Machine, listed: Sequence[Shown], valves: bool = False) -> str:
    """Quantities of every leg, the legs side by side."""
    legs = machine.mechanism.legs
    rows = [[_of_leg(book, machine, leg, q) for leg in legs] for q in listed]
    if valves:
        stands = {leg: _stands(book.tracks, machine, leg) for leg in legs}
        rows.append([book.add(*valve_chart(book, leg, own)) for leg, own in stands.items()])
    figures = (figure for row in rows for figure in row if any(row))
    return f'<div class="grid legs">{"".join(figures)}</div>'


def rig_charts(book: Book) -> str:
    """All columns of a rig, whatever it is; valves as bars."""
    named = dict.fromkeys(f"{n} [{t.t.unit(n)}]" for t in book.tracks for n in t.t.names)
    known = {q.name: q for q in RIG}
    figures = []
    for header in named:
        name, _, unit = header.rstrip("]").partition(" [")
        if "valve/" not in name:
            q = known.get(name, Shown(name, name, unit))
            figures.append(book.add(*_pair(book, q, q.name, q.title, ())))
    figures.append(book.add(*valve_chart(book, "", ())))
    return f'<div class="grid">{"".join(figures)}</div>'


def _of_leg(book: Book, machine: Machine, leg: str, q: Shown) -> str:
    levels = [q.factor * level for level in machine.limits.get(q.level, ())]
    stands = _stands(book.tracks, machine, leg)
    return book.add(*_pair(book, q, f"{leg}/{q.name}", f"{leg.title()} {q.title}", stands, levels))


def _pair(
    book: Book, q: Shown, name: str, title: str, stands: Spans, levels: Sequence[float] = ()
) -> Iterable[Chart]:
    """The quantity of all motions; below it what each differs from the plan."""
    having = [(i, track) for i, track in enumerate(book.tracks) if name in track.t]
    values = {i: on_grid(track, name, book.grid, q.steps) for i, track in having}
    names = [track.name for track in book.tracks]
    lines = [Curve(names[i], q.factor * v, i) for i, v in values.items()]
    yield Chart(title, q.unit, lines, levels=levels, stands=stands, least=q.least)
    plan = plan_of(book.tracks)
    if plan and name in plan.t and len(values) > 1 and q.name not in NO_FORCE_ERROR:
        planned, (unit, factor) = values[book.tracks.index(plan)], q.error
        errors = [
            Curve(f"{names[i]} minus plan", factor * (v - planned), i)
            for i, v in values.items()
            if book.tracks[i] is not plan
        ]
        least = q.error_least
        yield Chart(f"{title}, error", unit, errors, stands=stands, small=True, least=least)


def valve_chart(book: Book, leg: str, stands: Spans) -> Iterable[Chart]:
    """When each valve was switched on and off, as bars with exact edges."""
    rows = []
    for side in ("extend", "retract"):
        name = f"{leg}/valve/{side}" if leg else f"valve/{side}"
        lanes = [
            (i, track.source.spans(np.asarray(np.nan_to_num(track.t[name]) > 0.5)))
            for i, track in enumerate(book.tracks)
            if name in track.t
        ]
        if lanes:
            rows.append((side, lanes))
    title = f"{leg.title()} valves: when on" if leg else "Valves: when on"
    if rows:
        yield Chart(title, "", rows=rows, stands=stands)


def _stands(tracks: Sequence[Track], machine: Machine, leg: str) -> Spans:
    """When the foot stands in the first motion."""
    return stance_spans(tracks[0].source, machine, leg)


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
    course = machine.course(t)
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
    each = ((i, times) for i, e in enumerate(listed) if e for times in e.touchdowns.values())
    return [(round(time, 4), i) for i, times in each for time in times]
