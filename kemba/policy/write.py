"""A policy's file: everything that its player needs, as arrays."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import numpy as np

from kemba.errors import KembaError
from kemba.events import PLANNED, read
from kemba.model import Model
from kemba.plant.controller import PERIOD, Gains, hip_control, read_controller
from kemba.plant.repeat import Sensors
from kemba.plant.retiming import edges_of
from kemba.policy.course import course_of
from kemba.policy.modes import (
    ADDED,
    BLIND,
    EDGE,
    FADING,
    FEWEST,
    JOINT,
    JOINT_RATE,
    LATEST,
    PITCH,
    PITCH_RATE,
    PLACE,
    SPEED,
    TORQUE,
    WINDOW,
    Array,
    Edge,
    Event,
    EventCourse,
    Flow,
    Saltation,
    Tick,
    plain,
)
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


@dataclass(frozen=True)
class Expected:
    """The mean (rows, k) of what is measured, and the slopes (rows, n, 2 k) by which the deviation
    of the state x follows from measured deviations and their rates.

    The slopes are the best linear estimate: what sensors add by noise, and what is usual in
    executions, are weighed against each other. So noise alone moves nothing, and chambers that are
    not measured are inferred from what is.
    """

    mean: Array
    estimate: Array


def expected_from(
    executions: Sequence[Trajectory],
    clock: Array,
    measured: Sequence[str],
    states: Sequence[str],
    noise: Mapping[str, float],
) -> Expected:
    """What `executions` of a table under various conditions do at the times `clock` (rows,) [s].

    `noise`: 1 sigma by the ending of a measured column, in its unit.
    """
    y = np.array([_columns(motion, clock, measured) for motion in executions])
    x = np.array([_columns(motion, clock, states) for motion in executions])
    mean = y.mean(axis=0)
    y, x = y - mean, x - x.mean(axis=0)
    both = np.concatenate([y, _rates(y, clock)], axis=2)
    count = len(executions)
    sigma = np.array([noise.get(name.split("/")[-1], 0.0) for name in measured])
    added = _noise(sigma, float(np.median(np.diff(clock))))
    across = np.einsum("erx,ery->rxy", x, both) / count
    own = np.einsum("erx,ery->rxy", both, both) / count + added
    return Expected(mean, across @ np.linalg.pinv(own, hermitian=True))


def _columns(motion: Trajectory, clock: Array, names: Sequence[str]) -> Array:
    """Columns (rows, k) at the times of a clock; zero where the motion has no such column."""
    found = np.zeros((len(clock), len(names)))
    for k, name in enumerate(names):
        if name in motion:
            found[:, k] = np.interp(clock, motion.time, motion[name])
    return found


def _rates(y: Array, clock: Array) -> Array:
    """Rates (executions, rows, k) as the player has them: by a line through the last ticks."""
    period = float(np.median(np.diff(clock)))
    found = np.zeros_like(y)
    for row in range(2, y.shape[1]):
        first = max(0, row - WINDOW + 1)
        weights = _line(row - first + 1, period)
        found[:, row] = np.einsum("t,etk->ek", weights, y[:, first : row + 1])
    return found


def _line(count: int, period: float) -> Array:
    """Weights (count,) [s-1] by which successive values give the slope of a line through them."""
    time = (np.arange(count) - (count - 1) / 2) * period
    return np.asarray(time / (time @ time))


def _noise(sigma: Array, period: float) -> Array:
    """Covariance (2 k, 2 k) of the noise of values and their rates."""
    weights = _line(WINDOW, period)
    values = np.diag(sigma**2)
    between, rates = values * weights[-1], values * (weights @ weights)
    return np.block([[values, between], [between, rates]])


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
    model = course.hybrid.model
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
        found = expected_from(executions, clock, names, [q.name for q in model.state], noise)
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
        "most_torque": np.array(ADDED),
        "most_shift": np.array(LATEST),
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
        for k, tick in enumerate(edges_of(table)[name]):
            gain = gains.get((name, k), np.zeros(course.hybrid.size))
            listed.append((tick, v, float(k % 2 == 0), gain @ to_x[tick]))
    listed.sort(key=lambda edge: edge[:2])
    size = to_x.shape[2]
    return {
        "valves": np.array(valves),
        "edge_tick": np.array([e[0] for e in listed], dtype=int),
        "edge_valve": np.array([e[1] for e in listed], dtype=int),
        "edge_value": np.array([e[2] for e in listed]),
        "edge_gain": np.array([e[3] for e in listed]).reshape(-1, size) / PERIOD,
    }


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
