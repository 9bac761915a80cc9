"""Courses of a rig as points of a cube, so that a search can go through them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kemba.identify.design.settings import RigCourseSettings
from kemba.identify.problem.problem import Array
from kemba.plant.rigs import CourseRig

STEEPEST = 1.5  # highest speed of a monotone cubic piece that begins and ends at rest, by its mean


def dimensions() -> int:
    """Numbers that a course is made of: its places, twice the pulses of each valve, its laps."""
    settings = RigCourseSettings
    return settings.places + 4 * settings.pulses + 1


def course(point: Array, duration: float, stroke: float) -> CourseRig:
    """The course of a point (k,) of the unit cube, which lasts `duration` [s]."""
    settings = RigCourseSettings
    count, pulses = settings.places, settings.pulses
    laps = 1 + min(int(point[-1] * settings.most_laps), settings.most_laps - 1)
    every = duration / (laps * (count - 1))
    first, second = np.split(point[count:-1], 2)
    way = np.append(np.tile(point[: count - 1], laps), point[count - 1]) * stroke
    places = _reachable(way, settings.fastest * every / STEEPEST)
    return CourseRig(
        name="designed",
        places=tuple(round(float(x), 5) for x in places),
        every=every,
        extend=_spans(first, duration, pulses, settings.dwell),
        retract=_spans(second, duration, pulses, settings.dwell),
    )


def _reachable(places: Array, reach: float) -> Array:
    """Places (k,), each within `reach` of the one before."""
    found = [float(places[0])]
    for x in places[1:]:
        found.append(float(np.clip(x, found[-1] - reach, found[-1] + reach)))
    return np.array(found)


def _spans(
    weights: Array, duration: float, pulses: int, dwell: float
) -> tuple[tuple[float, float], ...]:
    """Spans in which a valve is on: `weights` (2 pulses,) share the time among breaks and pulses,
    each of which lasts at least `dwell` [s] where the time suffices; the last break takes a mean
    share."""
    weights = np.append(weights, 0.5) + 1e-3
    dwell = min(dwell, 0.5 * duration / len(weights))
    parts = dwell + weights / weights.sum() * (duration - dwell * len(weights))
    edges = np.round(np.cumsum(parts[:-1]), 4)
    return tuple((float(edges[2 * i]), float(edges[2 * i + 1])) for i in range(pulses))


def beginnings(count: int, seed: int) -> Array:
    """Points (count, k) from which a search begins: plain courses, then points that fill the
    cube evenly."""
    from scipy.stats import qmc

    settings = RigCourseSettings
    plain = np.array(list(_plain(settings.places, settings.pulses)))
    more = max(count - len(plain), 1)
    even = qmc.Sobol(dimensions(), rng=seed).random_base2(int(np.ceil(np.log2(more))))
    return np.asarray(np.vstack([plain, even])[:count])


def _plain(places: int, pulses: int) -> Iterator[Array]:
    """Courses that a person would think of: a rod at rest, one slow stroke, strokes to and fro;
    each with the valves in turn, and
    several times with both of them together."""
    ways = [
        np.full(places, 0.5),
        np.linspace(0.05, 0.95, places),
        0.5 - 0.45 * np.cos(np.arange(places) * np.pi / 2),
    ]
    early, late = np.tile([0.2, 0.5], pulses), np.tile([0.5, 0.2], pulses)
    for way in ways:
        yield np.concatenate([way, early, late, [0.0]])
        yield np.concatenate([way, early, early, [1.0]])
