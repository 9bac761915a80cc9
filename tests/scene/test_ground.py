"""The ground: numbers and symbols agree, derivatives are finite, edges lie on the lower side."""

import casadi as ca
import numpy as np
import pytest

from kemba.errors import ConfigErrors, KembaError
from kemba.scene import FLAT, Scene, scene_in
from kemba.scene.scene import AROUND

HOUSE = {
    "terrain": [
        {"from": "0.45 m", "height": "0.15 m"},
        {"from": "0.9 m", "height": "-0.1 m"},
        {"from": "1.2 m", "slope": "10 deg"},
        {"from": "0 m", "friction": 0.6},
    ],
    "obstacles": [{"from": "0.2 m", "to": "0.25 m", "height": "0.2 m"}],
}
PLACES = np.linspace(-0.5, 2.0, 2501)


def written(x: np.ndarray) -> np.ndarray:
    """The ground of `HOUSE` with sharp edges."""
    ramp = -0.1 + np.tan(np.deg2rad(10.0)) * (x - 1.2)
    return np.select([x < 0.45, x < 0.9, x < 1.2], [0.0, 0.15, -0.1], ramp)


def test_heights_are_those_written_beside_the_edges_and_never_lower() -> None:
    ground = scene_in(HOUSE).ground
    found, sharp = ground.height(PLACES), written(PLACES)
    near = np.min(np.abs(PLACES[:, None] - [0.45, 0.9, 1.2]), axis=1) < 0.0201
    assert found[~near] == pytest.approx(sharp[~near], abs=1e-12)
    assert (found - sharp).min() > -2e-4  # at the foot of the ramp
    assert (found >= sharp - 1e-12)[PLACES < 1.18].all()
    assert ground.extent == pytest.approx((-0.1, written(np.array([5.0]))[0]), abs=2e-4)


def test_numbers_arrays_and_symbols_agree_with_finite_derivatives() -> None:
    ground, x = scene_in(HOUSE).ground, ca.SX.sym("x")
    expressions = [ground.height(x), ground.slope(x), ca.jacobian(ground.slope(x), x)]
    expressions += [*ground.normal(x), ground.friction(x, 1.0)]
    values = np.array(ca.Function("f", [x], [ca.vertcat(*expressions)])(PLACES[None, :]))
    assert np.isfinite(values).all()
    assert values[0] == pytest.approx(ground.height(PLACES), abs=1e-14)
    assert values[1] == pytest.approx(ground.slope(PLACES), abs=1e-12)
    step = 1e-6
    differences = (ground.height(PLACES + step) - ground.height(PLACES - step)) / (2 * step)
    assert values[1] == pytest.approx(differences, abs=1e-4)
    assert values[3] ** 2 + values[4] ** 2 == pytest.approx(np.ones(len(PLACES)))
    assert values[5] == pytest.approx(ground.friction(PLACES, 1.0))
    assert ground.height(0.5) == pytest.approx(0.15)


def test_a_point_in_a_wall_is_as_deep_as_the_way_out() -> None:
    """5 mm behind a wall of 15 cm, 10 cm below its top; in level ground and above any."""
    ground = scene_in({"terrain": HOUSE["terrain"][:1]}).ground
    x, z = np.array([0.455, 1.0, 0.0, 0.2]), np.array([0.05, 0.12, 0.01, -0.03])
    deep = ground.depth(x, z)
    assert 0.005 < deep[0] < 0.025  # the edge is rounded over 2 cm
    assert deep[1:] == pytest.approx([0.03, 0.0, 0.03], abs=1e-9)
    assert FLAT.ground.depth(x, z) == pytest.approx([0.0, 0.0, 0.0, 0.03])


def test_level_ground_is_plain_numbers() -> None:
    assert FLAT.ground.height(PLACES) == 0.0 and FLAT.ground.normal(ca.SX.sym("x")) == (0.0, 1.0)
    raised = scene_in({"terrain": [{"height": "0.37 m"}]})
    assert raised.ground.level == 0.37 and raised.even and not raised.plain
    assert FLAT.plain and scene_in({}) is FLAT
    assert scene_in(HOUSE).ground.level is None and not scene_in(HOUSE).even


def distances(scene: Scene) -> ca.Function:
    """Of a point from each part of the ground, and from each obstacle."""
    x, z = ca.SX.sym("x"), ca.SX.sym("z")
    solids = [*scene.ground.stretches, *(box.solid(scene.ground) for box in scene.obstacles)]
    return ca.Function("distances", [x, z], [solid.distance(x, z) for solid in solids])


def test_a_point_is_as_far_from_a_solid_as_its_height_or_its_way_aside() -> None:
    """Ground up to the wall at 0.45 m, behind it, behind the wall at 0.9 m; the box."""
    far = distances(scene_in(HOUSE))
    for x, z, found in (
        (0.4, 0.1, [0.1, 0.03, 0.52, 0.14]),  # before the first wall
        (0.55, 0.2, [0.2, 0.05, 0.37, 0.29]),  # on what lies behind it
        (0.22, 0.3, [0.3, 0.21, 0.7, 0.1]),  # above the box
        (0.1, 0.1, [0.1, 0.33, 0.82, 0.09]),  # beside it
        (0.95, 0.0, [0.52, 0.03, 0.1, 0.69]),  # fallen off the second wall
    ):
        assert [float(d) for d in far(x, z)] == pytest.approx(found, abs=1e-9)
    assert len(FLAT.ground.stretches) == 1
    assert len(scene_in({"terrain": HOUSE["terrain"][2:3]}).ground.stretches) == 1  # a ramp: none


def test_distances_are_smooth_and_never_more_than_there_is() -> None:
    x, z = ca.SX.sym("x"), ca.SX.sym("z")
    box = scene_in(HOUSE).obstacles[0].solid(FLAT.ground)
    room = box.distance(x, z)
    slopes = ca.gradient(room, ca.vertcat(x, z))
    f = ca.Function("f", [x, z], [room, slopes, ca.jacobian(slopes, ca.vertcat(x, z))])
    for place in np.random.default_rng(0).uniform([0.1, -0.1], [0.35, 0.4], (400, 2)):
        found, slope, second = (np.array(value) for value in f(*place))
        aside = max(box.begin - place[0], place[0] - box.end)
        sharp = max(aside, place[1] - 0.2)
        assert found <= sharp + 1e-12 and np.isfinite(second).all()
        if sharp > 0.0:  # outside it changes no faster than points move
            assert found > sharp - 1.5e-3 and np.abs(slope).sum() < 1.6
        elif aside < -0.03 and place[1] > 0.0:  # well within, the way out is up
            assert slope.ravel() == pytest.approx([0.0, 1.0])


def test_a_scene_is_read_back_from_what_it_writes() -> None:
    scene = scene_in(HOUSE)
    assert scene_in(scene.dump()) == scene and hash(scene_in(scene.dump())) == hash(scene)
    assert Scene(terrain=scene.terrain).dump().keys() == {"terrain"}


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ({"terrain": [{"from": "0.5 m", "height": 0.1}, {"from": "0.52 m", "height": 0.2}]},
         "terrain[1]: says the height from 0.52 m on, within the edge of terrain[0]"),
        ({"terrain": [{"height": 0.1}, {"slope": "3 deg"}]}, "terrain[1]: says the height every"),
        ({"terrain": [{"friction": 1.0}, {"friction": 0.3}]}, "terrain[1]: says the friction"),
        ({"obstacles": [{"from": 0.1, "to": 0.2, "height": 0.1},
                        {"from": 0.15, "to": 0.3, "height": 0.1}]},
         "obstacles[1]: overlaps obstacles[0]"),
        ({"obstacles": [{"from": 0.1, "to": 0.2, "height": 0.1},
                        {"from": 0.22, "to": 0.3, "height": 0.1}]},
         "obstacles[1]: overlaps obstacles[0], edges of 2 cm included"),
        ({"terrain": [{"from": 0.1, "height": 0.1}],
          "obstacles": [{"from": 0.05, "to": 0.2, "height": 0.1}]},
         "obstacles[0]: stands on an edge"),
    ],
)  # fmt: skip
def test_what_overlaps_is_refused(keys: dict[str, object], told: str) -> None:
    with pytest.raises(KembaError) as caught:
        scene_in(keys, "log.meta.yaml")
    assert told in str(caught.value) and "log.meta.yaml" in str(caught.value)


def test_lines_that_say_nothing_or_have_wrong_units_are_refused() -> None:
    for line in ({"from": 0.1}, 3, {"height": "3 kg"}, {"slope": "80 deg"}, {"height": 1, "to": 2}):
        with pytest.raises(ConfigErrors, match=r"terrain\[0\]"):
            scene_in({"terrain": [line]})


def test_a_ramp_may_say_its_own_height() -> None:
    ground = scene_in({"terrain": [{"from": "1 m", "slope": "10 deg", "height": "5 cm"}]}).ground
    assert ground.height(np.array([2.0])) == pytest.approx([0.05 + np.tan(np.deg2rad(10.0))])


def test_a_scene_is_even_where_every_place_is_like_every_other() -> None:
    assert FLAT.even and scene_in({"terrain": [{"friction": 0.6}]}).even
    assert not scene_in({"terrain": [{"from": "0 m", "friction": 0.6}]}).even
    assert not scene_in(HOUSE).even


def test_the_skyline_keeps_as_far_from_either_side_of_an_obstacle() -> None:
    beside = np.array([-1.5, -0.5, 0.5, 1.5]) * AROUND + [0.2, 0.2, 0.25, 0.25]
    high = 0.2 + AROUND
    assert scene_in(HOUSE).skyline(beside) == pytest.approx([0.0, high, high, 0.0])


def test_a_levelled_scene_is_as_high_everywhere_and_free() -> None:
    """Its friction stays; a slope does, too, and is not level then."""
    lines = [
        {"height": "0.3 m"},
        {"from": "0.4 m", "height": "0 m"},
        {"from": "1 m", "friction": 0.5},
    ]
    boxes = [{"from": "-0.5 m", "to": "-0.4 m", "height": "0.2 m"}]
    level = scene_in({"terrain": lines, "obstacles": boxes}).levelled(0.0)
    assert level.ground.level == 0.3 and not level.obstacles
    assert level.ground.friction(1.5, 0.8) == 0.5
    ramp = scene_in({"terrain": [*lines, {"from": "2 m", "slope": "10 deg"}]})
    assert ramp.levelled(0.0).ground.level is None
