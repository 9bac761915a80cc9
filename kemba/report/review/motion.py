"""The motion on the page: every quantity of all runs over each other, the error below it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from kemba.plotting import Machine
from kemba.plotting.robot.machine import stance_spans
from kemba.report.review.charts import Book, Chart, Curve, Spans
from kemba.report.review.tracks import Track, on_grid, plan_of

DEGREES = 180.0 / np.pi


@dataclass(frozen=True)
class Shown:
    """A quantity on the page: its column, title, unit and factor from SI; for its error another
    unit and factor. `least`, `error_least`: smallest span of their axes, so that noise and
    rounding are not magnified."""

    name: str
    title: str
    unit: str
    factor: float = 1.0
    error: str = ""
    error_factor: float = 1.0
    least: float = 0.0
    error_least: float = 0.0
    steps: bool = False
    level: str = ""


BODY = (
    Shown("body/z", "Height of the body's centre", "m", 1.0, "mm", 1e3, 0.05, 1.0),
    Shown("body/x", "Body forward", "m", 1.0, "mm", 1e3, 0.05, 1.0),
    Shown("body/pitch", "Pitch, nose up", "deg", DEGREES, "deg", DEGREES, 4.0, 0.2),
)
JOINTS = (
    Shown("hip/q", "hip angle", "deg", DEGREES, "deg", DEGREES, error_least=0.2),
    Shown("piston/x", "piston extension", "mm", 1e3, "mm", 1e3, 0.0, 1.0, level="piston/x"),
)
FORCES = (
    Shown(
        "hip/tau", "hip torque", "N.m", error="N.m", error_least=0.2, steps=True, level="hip/tau"
    ),
    Shown("chamber/extend/P", "pressure of the extend chamber", "bar", 1e-5, "bar", 1e-5),
    Shown("chamber/retract/P", "pressure of the retract chamber", "bar", 1e-5, "bar", 1e-5),
    Shown("piston/F", "force of the piston rod", "N", error="N"),
    Shown("foot/Fz", "ground force, upward", "N", error="N"),
    Shown("foot/Fx", "ground force, along", "N", error="N"),
)
RIG = (
    Shown("piston/x", "Piston extension", "mm", 1e3, "mm", 1e3, least=1.0),
    Shown("piston/v", "Piston speed", "m/s", error="m/s", least=0.01),
    Shown("piston/F", "Force of the piston rod", "N", error="N", least=1.0),
    Shown("chamber/extend/P", "Pressure of the extend chamber", "bar", 1e-5, "bar", 1e-5, 0.1),
    Shown("chamber/retract/P", "Pressure of the retract chamber", "bar", 1e-5, "bar", 1e-5, 0.1),
)
NO_FORCE_ERROR = ("foot/Fz", "foot/Fx")  # a touchdown some ms late would fill the chart


def body_charts(book: Book, machine: Machine) -> str:
    """The body's coordinates."""
    stands = _stands(book.tracks, machine, "body")
    figures = (book.add(*_pair(book, q, q.name, q.title, stands)) for q in BODY)
    return f'<div class="grid">{"".join(figures)}</div>'


def leg_charts(book: Book, machine: Machine, listed: Sequence[Shown], valves: bool = False) -> str:
    """Quantities of every leg, the legs side by side."""
    rows = []
    for q in listed:
        rows.append([_of_leg(book, machine, leg, q) for leg in machine.mechanism.legs])
    if valves:
        rows.append(
            [
                book.add(*valve_chart(book, leg, _stands(book.tracks, machine, leg)))
                for leg in machine.mechanism.legs
            ]
        )
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
            q = known.get(name, Shown(name, name, unit, error=unit))
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
        planned = values[book.tracks.index(plan)]
        errors = [
            Curve(f"{names[i]} minus plan", q.error_factor * (v - planned), i)
            for i, v in values.items()
            if book.tracks[i] is not plan
        ]
        yield Chart(
            f"{title}, error", q.error, errors, stands=stands, small=True, least=q.error_least
        )


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
