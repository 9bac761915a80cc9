"""A policy's file: everything that its player needs, as arrays."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kemba.errors import KembaError
from kemba.events import PLANNED, read
from kemba.model import Model
from kemba.plant.controller import PERIOD, Gains, hip_control, read_controller
from kemba.plant.retiming import edges_of
from kemba.policy.course import course_of
from kemba.policy.modes import (
    ADDED,
    BLIND,
    EDGE,
    FADING,
    JOINT,
    JOINT_RATE,
    LATEST,
    PITCH,
    PITCH_RATE,
    PLACE,
    SPEED,
    TORQUE,
    Array,
    Edge,
    Event,
    EventCourse,
    Flow,
    Saltation,
    Tick,
    plain,
)
from kemba.policy.observer import Observer, measured, observer_of
from kemba.trajectory import Trajectory


@dataclass(frozen=True)
class PolicyGains:
    """`hips`: by tick, what to add to the torques (m, n) by the deviation of x; `edges`: for each
    edge that can move, by how many seconds later it is sent (n,) by the deviation of x at the
    tick at which it would be sent."""

    hips: dict[int, Array]
    edges: list[tuple[Edge, Array]]


def gains_of(course: EventCourse, landing: float) -> PolicyGains:
    """Gains for the time until the `landing` [s], and again from there to the end.

    No linear map leads through two feet that touch almost at once: the order in which they do
    decides what follows. So the deviation just before the landing is an end of its own.
    """
    before = [e for e in course.events if e.time < landing - 1e-9]
    after = [e for e in course.events if e.time >= landing - 1e-9]
    first, second = _gains(course, before), _gains(course, after)
    return PolicyGains({**first.hips, **second.hips}, [*first.edges, *second.edges])


def weights(course: EventCourse) -> Array:
    """The weight (n,) of every squared deviation of x; chambers count by what they do only."""
    model = course.hybrid.model
    sizes = {
        "body/x": PLACE, "body/z": PLACE, "body/pitch": PITCH,
        "body/vx": SPEED, "body/vz": SPEED,
        "body/pitch_rate": PITCH_RATE,
    }  # fmt: skip
    found = np.zeros(course.hybrid.size)
    names = [q.name for q in (*model.mechanism.coordinates, *model.mechanism.velocities)]
    for i, name in enumerate(names):
        joint = JOINT if name.endswith("/q") else JOINT_RATE
        found[i] = sizes.get(name, joint) ** -2
    return found


def _gains(course: EventCourse, events: Sequence[Event]) -> PolicyGains:
    """Backwards through the events: the cost to come is x^ P x^ with x^ = (x, torques)."""
    n, m = course.hybrid.size, len(course.joints)
    Q = np.zeros((n + m, n + m))
    Q[:n, :n] = np.diag(weights(course))
    P = Q.copy()
    hips: dict[int, Array] = {}
    acted: dict[int, Array] = {}
    closed: list[Array] = []  # maps through the events with the gains, in reverse
    for position in range(len(events) - 1, -1, -1):
        event = events[position]
        through = plain(event, n, m)
        if isinstance(event, Tick):
            E = np.vstack([np.zeros((n, m)), np.eye(m)])
            R = np.eye(m) / TORQUE**2 * 1e-3 / FADING
            K = -np.linalg.solve(R + E.T @ P @ E, E.T @ P @ through)
            if not event.hold.any():
                K[:] = 0.0  # the motors give all they can
            hips[event.tick] = K[:, :n]
            through = through + E @ K
            P = through.T @ P @ through + K.T @ R @ K
        elif isinstance(event, Edge):
            b = np.concatenate([event.late, np.zeros(m)])
            k = -(b @ P) / (EDGE**-2 + b @ P @ b)
            acted[position] = k
            through = np.eye(n + m) + np.outer(b, k)
            P = through.T @ P @ through + np.outer(k, k) / EDGE**2
        else:
            P = through.T @ P @ through
            if isinstance(event, Flow):
                P += Q * (event.end - event.time) / FADING
        P = (P + P.T) / 2
        closed.append(through)
    closed.reverse()
    edges = []
    for position, k in acted.items():
        edge = events[position]
        assert isinstance(edge, Edge)
        edges.append((edge, _when_sent(events, closed, position, edge.sent, k)[:n]))
    return PolicyGains(hips, edges[::-1])


def _when_sent(
    events: Sequence[Event], closed: Sequence[Array], position: int, sent: int, k: Array
) -> Array:
    """The gain of an edge by the deviation at the tick at which it is sent, before it acts."""
    for i in range(position - 1, -1, -1):
        k = k @ closed[i]
        event = events[i]
        if isinstance(event, Tick) and event.tick <= sent:
            break
        if isinstance(event, Saltation):
            break  # a deviation before an impact says little of what follows
    return k


def write_policy(model: Model, table: Trajectory, path: str | Path) -> Path:
    """The policy around a controller table, written to `path`; deviations are counted from the
    table's execution on `model`.

    Raises KembaError where the table cannot be simulated, or the model has contacts that are not
    rigid.
    """
    try:
        course = course_of(model, table)
    except ValueError as error:
        what = f"a feedback policy needs rigid contacts, but the model {error}"
        raise KembaError(model.name, what) from None
    arrays = policy_arrays(course)
    with Path(path).open("wb") as stream:
        np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]
    return Path(path)


def policy_arrays(course: EventCourse) -> dict[str, Array]:
    """The arrays of a policy by name, as docs/policy.md lists them with their shapes (n, k)."""
    model = course.hybrid.model
    table, motion = read_controller(course.table), course.motion
    ticks, first = len(table), round(table.time[0] / PERIOD)
    start = round(motion.time[0] / PERIOD) - first  # a robot that falls begins later
    rows = np.clip(np.arange(ticks) - start, 0, len(motion) - 1)
    names = measured(model)
    reference = np.column_stack([motion[n] for n in names])[rows]
    observer = observer_of(course, rows, first)
    landing = _landing(course)
    gains = gains_of(course, landing)
    hips = np.zeros((ticks, len(course.joints), course.hybrid.size))
    for tick, K in gains.hips.items():
        if 0 <= tick - first < ticks:
            hips[tick - first] = K
    touch = round(landing / PERIOD) - first
    near = np.abs(np.arange(ticks) - touch) <= BLIND
    hips[near] = 0.0
    by_edge = {(edge.valve, edge.index): gain for edge, gain in gains.edges}
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
        **{key: np.float32(getattr(observer, key)) for key in "ABCL"},
        "hip_gains": np.float32(hips),
        "most_torque": np.array(ADDED),
        "most_shift": np.array(LATEST),
        **_edges(course, by_edge, observer),
    }


def _edges(
    course: EventCourse, gains: dict[tuple[str, int], Array], observer: Observer
) -> dict[str, Array]:
    """Every edge of every valve in order of time: its gain, and what comes of its lateness."""
    table, zero = read_controller(course.table), np.zeros(course.hybrid.size)
    valves = [name for name in table.names if "/valve/" in name]
    listed = sorted(
        (tick, v, k)
        for v, name in enumerate(valves)
        for k, tick in enumerate(edges_of(table)[name])
    )
    keys = [(valves[v], k) for _, v, k in listed]
    late = [observer.late.get(key, (-1, zero)) for key in keys]
    size = (-1, len(zero))
    return {
        "valves": np.array(valves),
        "edge_tick": np.array([tick for tick, _, _ in listed], dtype=int),
        "edge_valve": np.array([v for _, v, _ in listed], dtype=int),
        "edge_value": np.array([float(k % 2 == 0) for _, _, k in listed]),
        "edge_gain": np.array([gains.get(key, zero) for key in keys]).reshape(size) / PERIOD,
        "edge_acts": np.array([row for row, _ in late], dtype=int),
        "edge_late": np.array([change for _, change in late]).reshape(size) * PERIOD,
    }


def _landing(course: EventCourse) -> float:
    """A tick before the first foot comes down after the apex [s]; the end where none does."""
    motion = course.motion
    landing = read(motion, PLANNED, course.hybrid.model.mechanism.weight).landing
    return landing - PERIOD if landing < np.inf else float(motion.time[-1])
