"""A Kalman filter along an executed table: deviations of the state from what sensors measure.

Deviations go from tick to tick by the maps of the course. What a policy adds to torques and how
late its valve edges are is known; what no model knows comes in as noise of rates and of effects'
states, more of it at impacts.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from kemba.model import Model
from kemba.plant.repeat import Sensors
from kemba.policy.modes import Array, Edge, Event, EventCourse, Saltation, Tick, plain

# 1 sigma of what a tick adds to the rates of the body [m/s], of its pitch and of joints [rad/s],
# and to an effect's state as a share of its largest value; three times as much lets the noise of
# usual sensors move edges further (docs/policy.md)
BODY, TURN, JOINT, STATE = 1e-3, 3e-3, 0.03, 3e-3
IMPACT = 0.1  # m/s or rad/s, which an impact adds: it comes at another instant than expected
PLACED = 0.01  # m or rad and their rates, by which a start is off; effects' states by STARTED
STARTED = 0.02  # of the largest value
FINEST = 1e-5  # m or rad; no sensor is better


@dataclass(frozen=True)
class Observer:
    """Deviations x (n,) from tick to tick, x' = A x + B u, of which y = C x is measured.

    A (rows, n, n), B (rows, n, m) by torques u that are added, C (rows, k, n), and the gains
    L (rows, n, k) of the filter. `late`: by valve and number of an edge the row at which it acts,
    and what x is changed by for each second (n,) by which it is late.
    """

    A: Array
    B: Array
    C: Array
    L: Array
    late: dict[tuple[str, int], tuple[int, Array]]


def observer_of(course: EventCourse, rows: Array, first: int) -> Observer:
    """The filter of a table whose ticks from `first` on are the `rows` (k,) of the course."""
    n, m, ticks = course.hybrid.size, len(course.joints), len(rows)
    A, B = np.tile(np.eye(n), (ticks, 1, 1)), np.zeros((ticks, n, m))
    late: dict[tuple[str, int], tuple[int, Array]] = {}
    noise = np.tile(_noise(course), (ticks, 1))
    rates = slice(course.hybrid.n, 2 * course.hybrid.n)
    for tick, between in _by_tick(course.events):
        row = tick.tick - first
        if not 0 <= row < ticks:
            continue
        whole, own = np.eye(n + m), dict[tuple[str, int], Array]()
        for event in between:
            through = plain(event, n, m)
            whole = through @ whole
            own = {key: through @ change for key, change in own.items()}
            if isinstance(event, Edge):
                own[event.valve, event.index] = np.concatenate([event.late, np.zeros(m)])
            elif isinstance(event, Saltation):
                noise[row, rates] += IMPACT
        A[row], B[row] = whole[:n, :n] + whole[:n, n:] @ tick.hold, whole[:n, n:]
        late |= {key: (row, change[:n]) for key, change in own.items()}
    C = outputs(course)[rows]
    return Observer(A, B, C, _filter(course, A, C, noise), late)


def measured(model: Model) -> list[str]:
    """What a policy measures: the body's place and pitch, hips, pistons."""
    names = [c.name for c in model.mechanism.coordinates]
    return [f"{n.split('/')[0]}/piston/x" if n.endswith("/knee/q") else n for n in names]


def outputs(course: EventCourse) -> Array:
    """At every row the slope (rows, k, n) of what is measured by x; a piston follows its knee."""
    model, hybrid = course.hybrid.model, course.hybrid
    mechanism = model.mechanism
    ports = dict(zip(measured(model), mechanism.coordinates, strict=True))
    pistons = [name for name in ports if name.endswith("/piston/x")]
    lengths = ca.vertcat(*(mechanism.port(name).phi for name in pistons))
    slopes = ca.Function("slopes", [mechanism.q], [ca.jacobian(lengths, mechanism.q)])
    places = [list(ports).index(name) for name in pistons]
    found = np.zeros((len(course.states), hybrid.n, hybrid.size))
    found[:, :, : hybrid.n] = np.eye(hybrid.n)
    for row, x in enumerate(course.states):
        found[row, places, : hybrid.n] = np.array(slopes(x[: hybrid.n]))
    return found


def _by_tick(events: Sequence[Event]) -> Iterator[tuple[Tick, list[Event]]]:
    """Every tick of the controller, and what happens until the next."""
    ticks = [(i, event) for i, event in enumerate(events) if isinstance(event, Tick)]
    ends = [*(i for i, _ in ticks[1:]), len(events)]
    for (i, tick), end in zip(ticks, ends, strict=False):
        yield tick, list(events[i + 1 : end])


def _noise(course: EventCourse) -> Array:
    """1 sigma (n,) of what a tick adds to each state."""
    by_name = {"body/vx": BODY, "body/vz": BODY, "body/pitch_rate": TURN}
    mechanism, largest = course.hybrid.model.mechanism, _largest(course)
    rates = [by_name.get(v.name, JOINT) for v in mechanism.velocities]
    return np.concatenate([np.zeros(course.hybrid.n), rates, STATE * largest])


def _largest(course: EventCourse) -> Array:
    """The largest value of each effect's state."""
    return np.asarray(np.abs(course.states[:, 2 * course.hybrid.n :]).max(axis=0))


def _filter(course: EventCourse, A: Array, C: Array, noise: Array) -> Array:
    """The gains (rows, n, k) by the covariance recursion."""
    usual = Sensors.usual().noise
    sigma = [usual.get(name.split("/")[-1], 0.0) for name in measured(course.hybrid.model)]
    R = np.diag(np.maximum(sigma, FINEST) ** 2)
    start = np.full(2 * course.hybrid.n, PLACED), STARTED * _largest(course)
    P, L = np.diag(np.concatenate(start) ** 2), np.zeros(C.swapaxes(1, 2).shape)
    for row, (a, c) in enumerate(zip(A, C, strict=True)):
        L[row] = np.linalg.solve(c @ P @ c.T + R, c @ P).T
        P = P - L[row] @ c @ P
        P = a @ P @ a.T + np.diag(noise[row] ** 2)
        P = (P + P.T) / 2
    return L
