"""Optima known from the books, found by the classes that plan the robot's jumps."""

import math

import numpy as np
import pytest
from ocp.toys import Push, Wall, Wire, bead, solve
from scipy.optimize import brentq

from kemba.effects.base import Effect


def minimum_time(nodes: int, *others: Effect) -> tuple[float, float, np.ndarray]:
    """Duration, switching time and forces of the quickest rest-to-rest metre."""
    program, point = solve(
        bead(),
        [Push(), *others],
        {"body/x": 0.0, "body/vx": 0.0},
        end={"body/x": 1.0, "body/vx": 0.0},
        duration=2.2,
        nodes=nodes,
        step_variation=0.5,
        cost={"duration": 1.0},
    )
    force, times = program.layout.full(point.Y, "u")[1:, 0], program.times(point.Y)
    switch = float(times[1:][force > 0].max())
    return float(times[-1]), switch, force


def test_minimum_time_double_integrator() -> None:
    """T = 2 sqrt(d/a), switching in the middle, approached at first order."""
    optimum = 2.0
    durations, switches, forces = zip(*(minimum_time(n) for n in (20, 40, 80)), strict=True)
    errors = np.abs(np.array(durations) - optimum)
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(1.0, abs=0.35)
    assert errors[-1] < 0.03
    assert switches[-1] == pytest.approx(optimum / 2, abs=0.05)
    for force in forces:
        assert np.count_nonzero(np.abs(np.abs(force) - 1.0) > 1e-4) <= 1, "bang-bang, one switch"
        assert np.count_nonzero(np.diff(np.sign(force))) == 1


@pytest.mark.parametrize("nodes", [20, 40])
def test_the_least_time_to_a_wall(nodes: int) -> None:
    """No need to brake where a wall stops: T -> sqrt(2 d / a) instead of 2 sqrt(d / a). By the
    implicit Euler method the mass stands in its last, shortest step; the others go
    (T^2 + sum h^2) / 2 far: equal ones need most time, ones at their bounds least."""
    shortest, longest = 0.5 * 2.2 / nodes, 1.5 * 2.2 / nodes
    moving = nodes - 1
    equal = math.sqrt(2.0 * moving / (moving + 1)) + shortest

    def way(time: float) -> float:
        """What steps at their bounds, one in between, cover in `time`."""
        long, rest = divmod(time - moving * shortest, longest - shortest)
        squares = long * longest**2 + (moving - 1 - long) * shortest**2 + (shortest + rest) ** 2
        return (time**2 + squares) / 2.0

    least = brentq(lambda time: way(time) - 1.0, moving * shortest, 2.0) + shortest
    assert math.sqrt(2.0) < least < equal < math.sqrt(2.0) + 0.5 / nodes  # of first order
    assert least - 1e-6 < minimum_time(nodes, Wall())[0] < equal + 1e-6


def brachistochrone(nodes: int) -> tuple[float, float]:
    """Duration of the quickest slide 1 m forward and 1 m down, and spread of the turning rate."""
    program, point = solve(
        bead("xz", gravity=9.81),
        [Wire()],
        {"body/x": 0.0, "body/z": 0.0, "body/vx": 0.0, "body/vz": 0.0},
        end={"body/x": 1.0, "body/z": -1.0},
        duration=0.6,
        nodes=nodes,
        step_variation=0.5,
        cost={"duration": 1.0},
    )
    turn = program.layout.full(point.Y, "u")[2:, 0]
    return float(program.times(point.Y)[-1]), float(np.ptp(turn) / np.mean(turn))


def test_brachistochrone() -> None:
    """The cycloid through (1, -1): its duration, and its constant turning rate."""
    phi = brentq(lambda p: (p - math.sin(p)) / (1 - math.cos(p)) - 1.0, 1.0, 4.0)
    optimum = phi * math.sqrt(1.0 / (1 - math.cos(phi)) / 9.81)
    coarse, fine = (brachistochrone(nodes)[0] for nodes in (25, 50))
    assert abs(fine - optimum) < 0.03 * optimum
    assert abs(coarse - optimum) / abs(fine - optimum) == pytest.approx(2.0, abs=0.5)


def test_a_periodic_stride_through_a_given_speed() -> None:
    """0.1 m in 1 s, as fast at the end as at the start, 0.2 m/s in the middle, least force squared.

    By symmetry v = 0.2 - 0.6 s + 0.6 s**2 with s the time from the middle: 0.05 m/s at both ends,
    and the integral of the squared force is 0.12 N2.s.
    """
    costs, ends = [], []
    for nodes in (40, 80):
        program, point = solve(
            bead(),
            [Push()],
            {"body/x": 0.0},
            goals={
                "stride": {"quantity": "at(end, body/x) - at(start, body/x)", "equals": 0.1},
                "fast": {"quantity": "body/vx", "at": "middle", "equals": 0.2},
            },
            periodic=True,
            duration=1.0,
            nodes=nodes,
            step_variation=0.0,
            cost={"gentle": {"expression": "push/F^2", "weight": 1.0}},
        )
        force, v = program.layout.full(point.Y, "u")[1:, 0], program.layout.full(point.Y, "v")[:, 0]
        costs.append(float(force @ force / nodes))
        ends.append((float(v[0]), float(v[-1])))
    assert abs(costs[1] - 0.12) < 0.003
    ratio = (costs[0] - 0.12) / (costs[1] - 0.12)
    assert ratio == pytest.approx(
        4.0, abs=0.4
    )  # the motion is symmetric: errors of first order cancel
    assert ends[1] == pytest.approx((0.05, 0.05), abs=2e-3) and ends[1][0] == pytest.approx(
        ends[1][1]
    )
