"""The course of an executed table: flows, controller ticks, valve edges and impacts in order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kemba.model import Model
from kemba.plant.commands import JointControl, among, delayed, merged
from kemba.plant.controller import PERIOD, condition_of, read_controller
from kemba.plant.simulate import Impact as Hit
from kemba.plant.simulate import simulate_one
from kemba.policy.builder import Builder, switches
from kemba.policy.events import EventCourse
from kemba.policy.modes import Array, Hybrid
from kemba.policy.settings import BESIDE, FINER, PASSES
from kemba.trajectory import Trajectory


def course_of(model: Model, table: Trajectory, extra: float = 0.0) -> EventCourse:
    """The linearised execution of a controller table, `extra` [s] after its last row included.

    Raises KembaError where the table cannot be simulated, ValueError for a model with other pairs
    than rigid contacts and stops.
    """
    table, hybrid = read_controller(table), Hybrid(model)
    condition, begin = condition_of(table, model, extra=extra)
    commands, last = condition.commands, condition.duration
    assert commands is not None and isinstance(commands.feedback, JointControl)
    acting = delayed(model, dict(commands.profiles))
    switched = np.concatenate([switches(p) for p in acting.values()])
    clock = np.arange(round((last - 1e-9) / PERIOD) + 1) * PERIOD
    done, finer = simulate_one(condition), np.zeros(0)
    for number in range(PASSES):  # marks near an impact move it by some microseconds
        hits = np.array([time[:2] for time in _clusters(done.impacts, last)]).reshape(-1, 2)
        beside = np.concatenate([hits[:, 0] - BESIDE, hits[:, 1] + BESIDE])
        marks = merged(clock, switched[switched > 0.0], beside, finer)
        inside = (
            (marks[:, None] > hits[:, 0] - BESIDE) & (marks[:, None] < hits[:, 1] + BESIDE)
        ).any(1)
        marks = marks[~inside]
        done = simulate_one(replace(condition, sample=marks[marks < last - 1e-9]))
        if number == 0:
            finer = _changes(hybrid, done.trajectory)
    motion, impacts = done.trajectory, _clusters(done.impacts, last)
    builder = Builder(hybrid, motion, dict(commands.profiles), acting, commands.feedback, begin)
    events = tuple(builder.events(clock, impacts))
    rows = np.flatnonzero(among(motion.time, clock))
    shown = {h: motion[n][rows] for h, n in zip(motion.headers, motion.names, strict=True)}
    shown_motion = Trajectory(motion.time[rows] + begin, shown)
    return EventCourse(
        hybrid, table, shown_motion, builder.x[rows], events, commands.feedback.joints
    )


def _changes(hybrid: Hybrid, motion: Trajectory) -> Array:
    """Times [s] within every step in which a contact changes, so that the change is found."""
    modes = [hybrid.modes(motion, i) for i in range(len(motion))]
    steps = [i for i in range(len(modes) - 1) if modes[i] != modes[i + 1]]
    inner = [np.linspace(motion.time[i], motion.time[i + 1], FINER + 1)[1:-1] for i in steps]
    return np.concatenate([np.zeros(0), *inner])


def _clusters(impacts: Sequence[Hit], last: float) -> list[tuple[float, float, set[str]]]:
    """Impacts that happen at once as one: from when to when [s], and at which pairs."""
    found = list[tuple[float, float, set[str]]]()
    for impact in (i for i in impacts if BESIDE < i.time < last - BESIDE):
        if found and impact.time - found[-1][1] < 4 * BESIDE:
            begin, _, labels = found.pop()
            found.append((begin, impact.time, labels | set(impact.labels)))
        else:
            found.append((impact.time, impact.time, set(impact.labels)))
    return found
