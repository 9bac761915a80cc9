"""Which effect's motion is followed first."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from blind import robot

from kemba.identify.discover import discover
from kemba.identify.evidence.search import Search

LIKELIEST, OTHER = ("geometry:piston/mount",), ("quadratic_damping",)
PUSH = {
    "effect": "quadratic_damping",
    "seed": 29053,
    "size": 1.5,
    "noise": 1.0,
    "figures_off": 0.02,
    "floor": 0.03,
    "runs": 4,
    "colour": {"keep": 0.95},
}


@pytest.mark.parametrize(
    ("errors", "moves", "followed"),
    [
        ((8.37, 3.19), True, OTHER),
        ((8.37, 3.19), False, ()),  # on a rig the logs are the motion
        ((8.37, 6.0), True, ()),
        ((1.2, 1.0), True, ()),  # no more than noise
    ],
)
def test_an_effect_that_leaves_far_less_than_the_likeliest_is_followed(
    errors: tuple[float, float], moves: bool, followed: tuple[str, ...]
) -> None:
    found = dict(zip((LIKELIEST, OTHER), errors, strict=True))
    points = {h: SimpleNamespace(fitted_error=error) for h, error in found.items()}
    points[("chambers:orifice",)] = SimpleNamespace(fitted_error=0.9)  # is built in instead
    problem = SimpleNamespace(moves=moves, structures={"chambers:orifice"})
    search = SimpleNamespace(problem=problem, points=points, ended=False)
    assert Search._leaves_far_less(search, LIKELIEST) == followed  # type: ignore[arg-type]


@pytest.mark.slow
def test_pistons_that_are_pushed_into_their_stops_are_no_orifices() -> None:
    """Along the first motion a damping of -62 N.s2.m-2 leaves 3.2 times the noise, the likeliest
    effect 8.4, and orifice chambers were built in beside that."""
    _, problem = robot.prepared(PUSH)
    assert discover(problem()).answer.ranking[0].effect == "quadratic_damping"
