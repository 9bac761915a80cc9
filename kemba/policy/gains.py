"""Hybrid LQR along a course: gains of the hips at every tick, and of every valve edge."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kemba.policy.events import Edge, Event, EventCourse, Flow, Saltation, Tick, plain
from kemba.policy.modes import Array
from kemba.policy.settings import (
    EDGE,
    FADING,
    JOINT,
    JOINT_RATE,
    PITCH,
    PITCH_RATE,
    PLACE,
    SPEED,
    TORQUE,
)


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
    before = [e for e in course.events if _time(e) < landing - 1e-9]
    after = [e for e in course.events if _time(e) >= landing - 1e-9]
    first, second = _gains(course, before), _gains(course, after)
    return PolicyGains({**first.hips, **second.hips}, [*first.edges, *second.edges])


def _time(event: Event) -> float:
    return event.begin if isinstance(event, Flow) else event.time


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
                P += Q * (event.end - event.begin) / FADING
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
