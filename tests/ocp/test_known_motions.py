"""Motions known from the books: a throw over a box, a jump from a piston, a hopper."""

import pytest
from ocp.toys import Leg, Stroke, bead, solve

from kemba.scene.scene import EDGE, Obstacle

G = 9.81


def test_the_gentlest_throw_over_a_box() -> None:
    """2 m far over a box of 0.8 m: the parabola through the box's upper corners.

    z = a x (2 - x) needs a >= h / (l (2 - l)) over a corner at l, and v0^2 = g (1 + 4 a^2) / (2 a)
    grows from a = 1/2 on, so that the corner decides.
    """
    box = Obstacle.model_validate({"from": "0.9 m", "to": "1.1 m", "height": "0.8 m"})
    corner = box.begin - EDGE / 2  # as much wider as rounded
    a = box.height / (corner * (2 - corner))
    program, point = solve(
        bead("xz", G, box),
        [],
        {"body/x": 0.0, "body/z": 0.0},
        end={"body/x": 2.0, "body/z": 0.0},
        goals={"gentle": {"quantity": "body/vx^2 + body/vz^2", "at": "start", "minimise": True}},
        duration=0.8,
        nodes=80,
        step_variation=0.9,
    )
    before, after = program.layout.full(point.Y, "v")[:2]
    middle = (before + after) / 2  # of the first step, in which implicit Euler falls at once
    assert middle @ middle == pytest.approx(G * (1 + 4 * a**2) / (2 * a), rel=2e-3)


def test_the_highest_jump_from_a_piston() -> None:
    """Its work F s lifts the mass by F s / (m g), approached at first order."""
    force, stroke = 40.0, 0.1
    errors = []
    for nodes in (20, 40):
        program, point = solve(
            bead("z", G),
            [Stroke(F=force, s=stroke)],
            {"body/z": 0.0, "body/vz": 0.0},
            relaxed=(10.0, 1.0, 0.1, 0.01, 1e-3),
            near={"body/z": 0.4},
            bounds={"body/z": {"at_least": 0.0}},
            goals={"high": {"quantity": "body/z", "at": "end", "maximise": True}},
            duration=0.35,
            nodes=nodes,
            step_variation=0.6,
        )
        errors.append(force * stroke / G - float(program.layout.full(point.Y, "q")[-1, 0]))
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.3)
    assert 2 * errors[1] - errors[0] == pytest.approx(0.0, abs=0.01)


def test_a_hopper_pushes_evenly() -> None:
    """Half of each stride on the ground: the mean force is the weight, and by Cauchy and Schwarz
    its square costs least where it is even."""
    stride, stance = 0.4, 0.5
    program, point = solve(
        bead("z", G),
        [Leg(F=100.0)],
        {"body/z": 0.0},
        goals={"air": {"quantity": "leg/F", "during": ["51 %", "100 %"], "equals": 0.0}},
        periodic={"except": []},
        duration=stride,
        nodes=40,
        step_variation=0.0,
        cost={"gentle": {"expression": "leg/F^2", "weight": 1.0}},
    )
    force = program.layout.full(point.Y, "u")[1:, 0]
    assert force[:20] == pytest.approx(G / stance, rel=1e-6)
    assert force @ force * stride / 40 == pytest.approx(G**2 * stride / stance, rel=1e-6)
