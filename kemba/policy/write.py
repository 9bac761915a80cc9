"""A policy's file: everything that its player needs, as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import casadi as ca
import numpy as np

from kemba.errors import KembaError
from kemba.events import PLANNED, read
from kemba.model import Model
from kemba.plant.controller import PERIOD, Gains, hip_control, read_controller
from kemba.plant.repeat import Sensors
from kemba.policy.course import course_of
from kemba.policy.events import EventCourse
from kemba.policy.expected import expected_from
from kemba.policy.gains import gains_of
from kemba.policy.modes import Array
from kemba.policy.settings import BLIND, FEWEST, WINDOW, PolicySettings
from kemba.trajectory import Trajectory

FILE = "policy.npz"


def write_policy(
    model: Model, table: Trajectory, path: str | Path, executions: Sequence[Trajectory] = ()
) -> Path:
    """The policy around an executed controller table, written to `path`.

    `executions` of the table under various conditions tell what deviations are expected and what
    the sensors say of them; without any, deviations are counted from the table on `model`. Raises
    KembaError where the table cannot be simulated, or the model has contacts that are not rigid.
    """
    try:
        course = course_of(model, table)
    except ValueError as error:
        what = f"a feedback policy needs rigid contacts, but the model {error}"
        raise KembaError(model.name, what) from None
    arrays = policy_arrays(course, executions)
    with Path(path).open("wb") as stream:
        np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]
    return Path(path)


def measured(model: Model) -> list[str]:
    """What a policy measures: the body's place and pitch, hips, pistons."""
    names = [c.name for c in model.mechanism.coordinates]
    return [f"{n.split('/')[0]}/piston/x" if n.endswith("/knee/q") else n for n in names]


def policy_arrays(
    course: EventCourse, executions: Sequence[Trajectory] = (), also: Sequence[str] = ()
) -> dict[str, Array]:
    """The arrays of a policy by name, as docs/policy.md lists them.

    `also`: columns of the executions that are measured as well, such as pressures.
    """
    model, settings = course.hybrid.model, PolicySettings.current()
    table, motion = read_controller(course.table), course.motion
    ticks, first = len(table), round(table.time[0] / PERIOD)
    start = round(motion.time[0] / PERIOD) - first  # a robot that falls begins later
    rows = np.clip(np.arange(ticks) - start, 0, len(motion) - 1)
    names = measured(model)
    reference = np.column_stack([motion[n] for n in names])[rows]
    to_x = _to_state(course)[rows]
    if len(executions) >= FEWEST:
        clock = (first + np.arange(ticks)) * PERIOD
        noise = Sensors.usual().noise
        names = [*names, *also]
        found = expected_from(executions, clock, names, _states(model), noise)
        reference, to_x = found.mean, found.estimate
    landing = _landing(course)
    gains = gains_of(course, landing)
    hips = np.zeros((ticks, len(course.joints), 2 * len(names)))
    for tick, K in gains.hips.items():
        if 0 <= tick - first < ticks:
            hips[tick - first] = K @ to_x[tick - first]
    touch = round(landing / PERIOD) - first
    near = np.abs(np.arange(ticks) - touch) <= BLIND
    hips[near] = 0.0
    by_edge = {(edge.valve, edge.index): gain for edge, gain in gains.edges}
    edges = _edges(course, by_edge, to_x, first)
    control = hip_control(model, table, Gains())
    return {
        "period": np.array(PERIOD),
        "first_tick": np.array(first),
        "measured": np.array(names),
        "reference": reference,
        "joints": np.array(course.joints),
        "joint_rows": np.array([names.index(f"{j}/q") for j in course.joints]),
        "wanted": control.wanted,
        "K_p": np.array(control.K_p),
        "K_d": np.array(control.K_d),
        "limits": control.limits,
        "hip_gains": hips,
        "most_torque": np.array(settings.added),
        "most_shift": np.array(settings.latest),
        "window": np.array(WINDOW),
        **edges,
    }


def _edges(
    course: EventCourse, gains: dict[tuple[str, int], Array], to_x: Array, first: int
) -> dict[str, Array]:
    """Every edge of every valve in order of time, with its gain by what is measured."""
    table = read_controller(course.table)
    valves = [name for name in table.names if "/valve/" in name]
    listed = []
    for v, name in enumerate(valves):
        switched = np.flatnonzero(np.diff(np.round(table[name]), prepend=0.0))
        for k, tick in enumerate(switched):
            gain = gains.get((name, k), np.zeros(course.hybrid.size))
            listed.append((int(tick), v, float(k % 2 == 0), gain @ to_x[tick]))
    listed.sort(key=lambda edge: edge[:2])
    size = to_x.shape[2]
    return {
        "valves": np.array(valves),
        "edge_tick": np.array([e[0] for e in listed], dtype=int),
        "edge_valve": np.array([e[1] for e in listed], dtype=int),
        "edge_value": np.array([e[2] for e in listed]),
        "edge_gain": np.array([e[3] for e in listed]).reshape(-1, size) / PERIOD,
    }


def _states(model: Model) -> list[str]:
    """The names of x: coordinates, velocities, effect states."""
    mechanism = model.mechanism
    moving = [q.name for q in (*mechanism.coordinates, *mechanism.velocities)]
    return [*moving, *(q.name for q in model.states.values())]


def _to_state(course: EventCourse) -> Array:
    """At every row the slope (rows, n, 2 measured) of x by what is measured and its rates.

    A knee follows from its piston; chambers are not measured, their deviation is taken as zero.
    """
    model, hybrid = course.hybrid.model, course.hybrid
    pistons = [model.mechanism.port(f"{leg}/piston/x").phi for leg in model.mechanism.legs]
    knees = [i for i, c in enumerate(model.mechanism.coordinates) if c.name.endswith("/knee/q")]
    jacobian = ca.jacobian(ca.vertcat(*pistons), model.mechanism.q)
    slopes = ca.Function("slopes", [model.mechanism.q], [jacobian])
    found = np.zeros((len(course.states), hybrid.size, 2 * hybrid.n))
    for row, x in enumerate(course.states):
        J = np.array(slopes(x[: hybrid.n]))
        scale = np.ones(hybrid.n)
        for k, i in enumerate(knees):
            scale[i] = 1.0 / J[k, i]
        found[row, : hybrid.n, : hybrid.n] = np.diag(scale)
        found[row, hybrid.n : 2 * hybrid.n, hybrid.n :] = np.diag(scale)
    return found


def _landing(course: EventCourse) -> float:
    """A tick before the first foot comes down after the apex [s]; the end where none does."""
    motion = course.motion
    landing = read(motion, PLANNED, course.hybrid.model.mechanism.weight).landing
    return landing - PERIOD if landing < np.inf else float(motion.time[-1])
