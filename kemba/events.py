"""A motion as events: when each foot comes down and leaves, and how high the body is in flight.

Plans, executions and logs are read by one set of rules, and two motions are compared by their
events: whether these come in the same order, when, and with the body at which place.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from itertools import combinations, product
from typing import Any, Literal

import numpy as np

from kemba.trajectory import Array, Trajectory

Mask = np.ndarray[Any, np.dtype[np.bool_]]

LASTS = 0.02  # s; the weight takes 0.2 m/s of a fall in that time: a shorter contact is a graze
STAYS = 5e-3  # m; a foot that rises less between two contacts has not left the ground
STANDS = 1e-3  # m; a lower foot stands in a pose
UPRIGHT = 0.35  # rad; a body that is turned by more has tipped over
# m/s; a body that stands and moves faster goes on: at a height of 0.3 m it would come to rest above
# a place 9 cm ahead (capture point, v sqrt(z / g)), half the distance between the feet
AT_REST = 0.5
ORDINALS = "first second third fourth fifth sixth seventh eighth ninth".split()


@dataclass(frozen=True)
class Thresholds:
    """How a motion is read: feet below `touches` [m] touch; an apex is that of a parabola through
    the rows within `around` [s] of the highest and those beside it, or the highest row itself where
    it is None."""

    touches: float
    around: float | None = None


PLANNED = Thresholds(1e-4)
EXECUTED = Thresholds(1e-6, 0.0)  # the gap that the simulator's kernel calls closed
# ten times the noise of the body's height; 40 readings average 0.3 mm of it to 0.05 mm
MEASURED = Thresholds(3e-3, 0.02)
# s before and after a foot seems to touch, in which its measured height bends: a soft landing loads
# it late
FALLS, RESTS = 0.03, 0.015


@dataclass(frozen=True)
class Span:
    """A contact of a foot or a flight of the body [s], infinite where the motion begins or ends
    with it. `heavy`: its force did as much as the weight does in `LASTS`."""

    begin: float
    end: float
    heavy: bool = False

    @property
    def firm(self) -> bool:
        """Whether it is more than a graze."""
        return self.heavy or self.end - self.begin >= LASTS

    def within(self, until: float) -> Span:
        """The part from 0 to `until` [s]."""
        begin, end = (min(max(t, 0.0), until) for t in (self.begin, self.end))
        return Span(begin, end, self.heavy and end > begin)


@dataclass(frozen=True)
class ContactCourse:
    """A motion with the contacts of every leg, grazes among them, by the clock `time` (n,) [s]."""

    motion: Trajectory
    time: Array
    contacts: Mapping[str, Sequence[Span]]
    reading: Thresholds

    @property
    def flights(self) -> list[Span]:
        """When no foot stands."""
        firm = [span for leg in self.contacts.values() for span in leg if span.firm]
        return [flight for flight in flights(firm) if flight.firm]

    @cached_property
    def top(self) -> tuple[float, float]:
        """When [s] the body is highest, and how high [m]."""
        return self.apex(Span(-math.inf, math.inf)) or (math.nan, math.nan)

    def apex(self, flight: Span, around: float | None = None) -> tuple[float, float] | None:
        """When [s] the body is highest in a flight, and how high [m]; None without a row in it.
        `around`: other than that of the reading."""
        z = self.motion["body/z"]
        rows = (self.time >= flight.begin) & (self.time <= flight.end) & np.isfinite(z)
        if around is None:
            around = self.reading.around
        return peak(self.time[rows], z[rows], around) if rows.any() else None

    def touchdowns(self, after: float = -math.inf, leg: str | None = None) -> list[float]:
        """When [s] feet, or that of one `leg`, come down firmly later than `after`."""
        spans = [s for name, own in self.contacts.items() if leg in (name, None) for s in own]
        begins = (span.begin for span in spans if span.firm)
        return sorted(time for time in begins if time > max(after, self.time[0]))

    @property
    def landing(self) -> float:
        """When [s] the first foot comes down after the highest point; infinite where none does."""
        return min(self.touchdowns(self.top[0]), default=math.inf)


def gap(motion: Trajectory, leg: str, point: str = "foot") -> Array:
    """Height (n,) [m] of a leg's foot, hip or knee above the ground beneath it: a column of its own
    where that is not level at 0."""
    place = f"{leg}/{point}"
    return motion[f"{place}/gap"] if f"{place}/gap" in motion else motion[f"{place}/z"]


def feet(motion: Trajectory) -> dict[str, Array]:
    """The `gap` (n,) [m] of the foot of every leg that a motion has."""
    names = (name for name in motion.names if name.endswith("/foot/z"))
    return {leg: gap(motion, leg) for leg in (name.removesuffix("/foot/z") for name in names)}


def read(
    motion: Trajectory,
    reading: Thresholds,
    weight: float = math.inf,
    clock: Array | None = None,
    hits: Mapping[str, Sequence[float]] | None = None,
) -> ContactCourse:
    """The course of a motion that has the places of feet, and their forces or not.

    `weight` [N] of the robot. `clock` (n,) [s]: other times of its rows. `hits`: by leg, when [s]
    its foot hits the ground exactly, as a simulation knows.
    """
    time, found = motion.time if clock is None else clock, {}
    for leg, height in feet(motion).items():
        exact = (hits or {}).get(leg, ())
        load = motion.get(f"{leg}/foot/Fz")
        found[leg] = contacts(time, height, reading, load, weight, exact)
    return ContactCourse(motion, time, found, reading)


def contacts(
    time: Array,
    height: Array,
    reading: Thresholds,
    load: Array | None = None,
    weight: float = math.inf,
    hits: Sequence[float] = (),
) -> list[Span]:
    """The contacts of a foot at a `height` (n,) [m] above the ground; see `read`.

    `load` (n,): force on the foot [N], without that of impacts.
    """
    down, low = height <= reading.touches, height < STAYS

    def span(i: int, j: int) -> Span:
        took = 0.0 if load is None else float(np.trapezoid(load[i:j], time[i:j]))
        begin = -math.inf if i == 0 else _begin(time, hits, i)
        end = math.inf if j == len(time) else float(time[j - 1])
        return Span(begin, end, took >= LASTS * weight)

    firm = np.zeros(len(time), dtype=bool)
    for i, j in runs(down):
        firm[i:j] = span(i, j).firm
    solid = bridged(firm, low)
    brief = bridged(down & ~solid, low & ~solid)  # grazes, and what they make together
    return sorted((span(*rows) for part in (solid, brief) for rows in runs(part)), key=_first)


def _first(span: Span) -> float:
    return span.begin


def _begin(time: Array, hits: Sequence[float], row: int) -> float:
    """When [s] a foot that is in the air in the row before touches."""
    before, at = float(time[row - 1]), float(time[row])
    return min((t for t in hits if before < t <= at + 1e-9), default=at)


def bend(time: Array, height: Array, near: float) -> float:
    """When [s] a foot that comes down at about `near` touches, by its measured `height` (n,) [m]:
    where a falling line and the level on which the foot then stands fit best, by least squares.

    Noise and zeros of the sensors hardly matter then. `near` where it falls by less than `STAYS`.
    """
    own = (time >= near - FALLS) & (time <= near + RESTS) & np.isfinite(height)
    at, z = time[own], height[own]
    if len(at) < 4:
        return near
    bends = np.arange(at[0], at[-1], 1e-4)[1:]
    fall = np.clip(bends[:, None] - at, 0.0, None)
    length, fall = fall.max(axis=1), fall - fall.mean(axis=1, keepdims=True)
    power, product = np.sum(fall**2, axis=1), np.maximum(fall @ (z - z.mean()), 0.0)
    best = int(np.argmax(product**2 / power))
    fell = product[best] / power[best] * length[best]
    return float(bends[best]) if fell >= STAYS else near


def bridged(down: Mask, low: Mask) -> Mask:
    """`down` (n,) with each break filled in which `low` (n,) holds all the time, also one between a
    contact and an end of the motion."""
    found = down.copy()
    for i, j in runs(~down):
        if low[i:j].all() and j - i < len(down):
            found[i:j] = True
    return np.asarray(found)


def runs(mask: Mask) -> list[tuple[int, int]]:
    """First row and the row after the last of every run of a mask (n,)."""
    edges = np.flatnonzero(np.diff(mask.astype(int), prepend=0, append=0))
    return [(int(i), int(j)) for i, j in edges.reshape(-1, 2)]


def flights(contacts: Sequence[Span]) -> list[Span]:
    """When no foot is on the ground, from the contacts of all legs; what is shorter than `LASTS`
    among them too."""
    found, last = [], -math.inf
    for one in sorted(contacts, key=_first):
        if one.begin > last:
            found.append(Span(last, one.begin))
        last = max(last, one.end)
    return [*found, Span(last, math.inf)] if last < math.inf else found


def peak(time: Array, z: Array, around: float | None = 0.0) -> tuple[float, float]:
    """Time [s] and height [m] of the highest point; see `Thresholds`."""
    i = int(np.argmax(z))
    if around is None or not 0 < i < len(z) - 1:
        return float(time[i]), float(z[i])
    first, last = np.searchsorted(time, [time[i] - around, time[i] + around])
    near = slice(min(i - 1, int(first)), max(i + 2, int(last)))
    c, b, a = np.polynomial.polynomial.polyfit(time[near] - time[i], z[near], 2)
    shift = -b / (2 * a) if a < 0 else 0.0
    reach = max(around, float(time[i + 1] - time[i - 1]))
    shift = float(np.clip(shift, -reach, reach))
    return float(time[i] + shift), float(c + shift * (b + a * shift))


def turned(pitch: float, planned: float) -> float:
    """How far [rad] a pitch is from the planned one, but for full turns."""
    return abs(math.remainder(pitch - planned, 2 * math.pi))


def ends_standing(plan: Trajectory, legs: Iterable[str]) -> list[str]:
    """The legs on which a plan stands at rest at its end; none where it ends in the air or goes on
    moving."""
    speed = [plan[name][-1] for name in ("body/vx", "body/vz") if name in plan]
    if np.linalg.norm(speed) > AT_REST:
        return []
    return [leg for leg in legs if f"{leg}/foot/z" not in plan or gap(plan, leg)[-1] <= STANDS]


@dataclass(frozen=True)
class Event:
    """A lift-off or touchdown of a leg's foot, or the apex of a flight: when [s] it was planned and
    executed, None where it was not; at an apex, executed minus planned place of the body."""

    kind: Literal["liftoff", "touchdown", "apex"]
    leg: str | None
    planned_s: float | None
    executed_s: float | None
    height_error_m: float | None = None
    x_error_m: float | None = None
    pitch_error_rad: float | None = None

    @property
    def time(self) -> float:
        """When [s] it was planned, else executed."""
        known = self.executed_s if self.planned_s is None else self.planned_s
        assert known is not None
        return known

    @property
    def error_s(self) -> float | None:
        """How late [s] it is."""
        if self.planned_s is None or self.executed_s is None:
            return None
        return self.executed_s - self.planned_s

    @property
    def words(self) -> str:
        """What the robot does: `lifts the front foot`."""
        does = {"liftoff": "lifts", "touchdown": "touches down with", "apex": "flies"}[self.kind]
        return f"{does} the {self.leg} foot" if self.leg else does

    def json(self) -> dict[str, Any]:
        """The entry of the certificate."""
        state = ("height_error_m", "x_error_m", "pitch_error_rad")
        own = {k: v for k, v in asdict(self).items() if self.kind == "apex" or k not in state}
        return {**own, "error_s": self.error_s}


@dataclass(frozen=True)
class PlannedLanding:
    """Feet that are planned to come down together: when [s], and when the first of them did."""

    legs: tuple[str, ...]
    planned: float
    executed: float

    @property
    def late(self) -> float:
        """How late [s] it is."""
        return self.executed - self.planned


@dataclass(frozen=True)
class EventComparison:
    """The events of a plan and its execution, in order of time."""

    events: tuple[Event, ...] = ()

    @property
    def apexes(self) -> list[Event]:
        """The apexes of flights that both have."""
        return [e for e in self.events if e.kind == "apex" and e.height_error_m is not None]

    def landings(self, together: float = math.inf) -> list[PlannedLanding]:
        """The planned touchdowns that were executed. Those within `together` [s] are one landing,
        unless a foot is to leave the ground in between."""
        found: list[list[Event]] = [[]]
        for event in (e for e in self.events if e.planned_s is not None and e.kind != "apex"):
            if event.kind == "liftoff" or (found[-1] and event.time - found[-1][0].time > together):
                found.append([])
            if event.kind == "touchdown" and event.executed_s is not None:
                found[-1].append(event)
        return [
            PlannedLanding(
                tuple(str(e.leg) for e in one), one[0].time,
                min(e.executed_s for e in one if e.executed_s is not None),
            )
            for one in found if one
        ]  # fmt: skip

    def missed(self, together: float = LASTS) -> str:
        """The first planned event that does not come, or comes before one that is planned earlier
        by more than `together` [s], in words; empty without any."""
        missing = [e for e in self.events if e.executed_s is None]
        for event in sorted(missing, key=lambda e: e.kind == "apex"):
            if event.kind == "apex":
                return f"has a foot on the ground in the flight of {event.time:.3f} s"
            return f"never {event.words}, planned at {event.time:.3f} s"
        feet = [
            (e, e.time, e.time + e.error_s) for e in self.events if e.leg and e.error_s is not None
        ]
        for (a, was, now), (b, later, sooner) in combinations(feet, 2):
            if later - was > together and sooner < now:
                return f"{b.words} before it {a.words}, not after"
        return ""

    @property
    def unplanned(self) -> str:
        """The first event that is not planned, in words; empty without any."""
        for event in (e for e in self.events if e.planned_s is None):
            same = [e for e in self.events if (e.kind, e.leg) == (event.kind, event.leg)]
            times = sorted(e.executed_s for e in same if e.executed_s is not None)
            number = times.index(event.time)
            at = f"at {event.time:.3f} s, which is not planned"
            if event.kind == "touchdown" and 0 < number < len(ORDINALS):
                foot = f"the {event.leg} foot"
                return f"touches the ground with {foot} a {ORDINALS[number]} time, {at}"
            return f"{event.words} {at}"
        return ""

    @property
    def difference(self) -> str:
        """What keeps the execution from having the plan's events in the plan's order."""
        return self.missed() or self.unplanned


def compared(plan: ContactCourse, real: ContactCourse) -> EventComparison:
    """A plan that begins at 0 s and its execution by their events; what an execution does before
    the plan or after it is left out.

    A contact that is a graze in both, or in one and absent in the other, is no event: by how much
    a short touch carries is a matter of degree.
    """
    until, found = float(plan.time[-1]), list[Event]()
    firm: tuple[list[Span], list[Span]] = [], []
    for leg in plan.contacts:
        for was, now in aligned(plan.contacts[leg], real.contacts.get(leg, ()), until):
            if not any(span and span.firm for span in (was, now)):
                continue
            for spans, span in zip(firm, (was, now), strict=True):
                spans += [span] if span else []
            found += _edges(leg, was, now, until)
    for was, now in aligned(flights(firm[0]), flights(firm[1]), until):
        if was and was.firm and was.end > 0.0 and was.begin < until:
            found.append(_apex(plan, real, was, now))
    return EventComparison(tuple(sorted(found, key=lambda event: event.time)))


def _edges(leg: str, was: Span | None, now: Span | None, until: float) -> Iterator[Event]:
    """The touchdown and the lift-off of a contact; `was` and `now` of plan and execution."""
    for kind, edge in (("touchdown", "begin"), ("liftoff", "end")):
        planned, executed = (getattr(s, edge) if s else math.nan for s in (was, now))
        asked = 0.0 < planned < until or (planned == until and math.isfinite(executed))
        done = 0.0 < executed < until
        if asked or done:
            yield Event(
                kind,  # type: ignore[arg-type]
                leg,
                planned if asked else None,
                executed if done or (asked and math.isfinite(executed)) else None,
            )


def _apex(plan: ContactCourse, real: ContactCourse, was: Span, now: Span | None) -> Event:
    """The apex of a planned flight, and that of the executed one. The time is between nodes, where
    a body moves on by millimetres from one to the next."""
    top, there = plan.apex(was), real.apex(now) if now else None
    time = (plan.apex(was, 0.0) or (math.nan,))[0]
    if top is None or there is None:
        return Event("apex", None, time, None)

    def off(name: str) -> float | None:
        if name not in plan.motion or name not in real.motion:
            return None
        planned = np.interp(time, plan.time, plan.motion[name])
        return float(np.interp(there[0], real.time, real.motion[name]) - planned)

    higher = there[1] - top[1]
    return Event("apex", None, time, there[0], higher, off("body/x"), off("body/pitch"))


def aligned(
    was: Sequence[Span], now: Sequence[Span], until: float
) -> list[tuple[Span | None, Span | None]]:
    """Spans of a plan and of its execution, in order, with their partners from 0 to `until` [s].

    As few firm spans as possible are left alone; then the begins are as near as possible (dynamic
    programming, as for the edit distance).
    """

    def cost(a: Span | None, b: Span | None) -> tuple[int, float]:
        """Firm spans without a partner, and how far [s] begins, and a little the ends, are off."""
        parts = [span.within(until) for span in (a, b) if span]
        if len(parts) == 1:
            return int(parts[0].firm), parts[0].end - parts[0].begin
        p, q = parts
        return 0, abs(p.begin - q.begin) + 1e-3 * abs(p.end - q.end)

    Pairs = tuple[tuple[Span | None, Span | None], ...]
    best: dict[tuple[int, int], tuple[int, float, Pairs]] = {(0, 0): (0, 0.0, ())}
    for i, j in list(product(range(len(was) + 1), range(len(now) + 1)))[1:]:
        ways = []
        for di, dj in ((1, 1), (1, 0), (0, 1)):
            if i >= di and j >= dj:
                a, b = was[i - 1] if di else None, now[j - 1] if dj else None
                (firm, time, pairs), (more, off) = best[i - di, j - dj], cost(a, b)
                ways.append((firm + more, time + off, (*pairs, (a, b))))
        best[i, j] = min(ways, key=lambda way: way[:2])
    return list(best[len(was), len(now)][2])
