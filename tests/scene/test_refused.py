"""Scenes that cannot be are refused in words before any solve."""

from pathlib import Path

import pytest

from kemba.config import shipped_configs
from kemba.errors import KembaError
from kemba.ocp.planning import check_feasible
from kemba.ocp.reading import load_task

SHIPPED = shipped_configs("tasks")["hurdle.yaml"].read_text(encoding="utf-8")
KEPT, _, REST = SHIPPED.partition("obstacles:\n")
AFTER = REST[REST.index("\nstart:") :]
NUMBER = KEPT.count("\n") + 1  # of the line with `obstacles:` or `terrain:`


def refused(folder: Path, scene: str, *options: str) -> str:
    """What is said of the shipped hurdle with another scene."""
    path = folder / "own.yaml"
    path.write_text(KEPT + scene + AFTER, encoding="utf-8")
    with pytest.raises(KembaError) as caught:
        check_feasible(*load_task(path, list(options)))
    return str(caught.value).replace(str(path), "own.yaml")


@pytest.mark.parametrize(
    ("scene", "line", "told"),
    [
        ("obstacles:\n  - {from: 0.1 m, to: 0.3 m, height: 0.2 m}\n", 1,
         "no pose of the robot does what the start asks: `obstacles[0]`"),
        ("obstacles:\n  - {from: 0.3 m, to: 2 m, height: 0.2 m}\n", 1,
         "no pose of the robot does what the end asks"),
        ("terrain:\n  - {from: 0.1 m, height: 0.15 m}\n", 0,
         "no pose of the robot does what the start asks"),
        ("terrain:\n  - {from: 0.5 m, height: 0.1 m}\n  - {from: 0.51 m, height: 0 m}\n", 2,
         "terrain[1]: says the height from 0.51 m on, within the edge of terrain[0]"),
        ("obstacles:\n  - {from: 0.3 m, to: 0.4 m, height: 0.2 m}\n"
         "  - {from: 0.35 m, to: 0.5 m, height: 0.1 m}\n", 2, "obstacles[1]: overlaps"),
        ("obstacles:\n  - {from: 0.4 m, to: 0.3 m, height: 0.2 m}\n", 1,
         "obstacles[0]: to 0.3 m does not come after from 0.4 m"),
        ("obstacles:\n  - {from: 0.3 m, to: 0.4 kg, height: 0.2 m}\n", 1,
         "obstacles[0].to: '0.4 kg' is a mass"),
        ("terrain:\n  - {from: 0.3 m, height: 5 deg}\n", 1, "a length such as"),
        ("terrain:\n  - {from: 0.3 m}\n", 1, "one of slope, height, friction is expected"),
    ],
)  # fmt: skip
def test_a_wrong_scene_is_refused_at_its_line(
    tmp_path: Path, scene: str, line: int, told: str
) -> None:
    said = refused(tmp_path, scene)
    assert told in said
    assert f"own.yaml:{NUMBER + line}" in said


def test_motions_over_terrain_can_be_asked() -> None:
    for name in ("platform.yaml", "drop_off.yaml", "hurdle.yaml"):
        model, requirements = check_feasible(*load_task(name))
        assert not model.mechanism.scene.even
        assert any(r.quantity.name.endswith("foot/gap") for r in requirements)


def test_lengths_above_ground_with_walls_are_distances_from_each_part_of_it() -> None:
    """A foot that stands is asked by its gap, what must be clear by distances; feet always are."""
    for name, parts in (("platform.yaml", 2), ("hurdle.yaml", 0)):
        task, document = load_task(name)
        requirements = check_feasible(task, document)[1]
        clear = [r for r in requirements if r.text == "clearance"]
        assert len(clear) == 2 * max(parts, 1)
        assert all(("distance" in r.quantity.name) == bool(parts) for r in clear)
        assert all(r.lower == pytest.approx(0.03) for r in clear)
        assert sum(r.location == ("terrain",) for r in requirements) == 2 * parts
        assert {r.quantity.name for r in requirements if r.text == "end.*/foot/gap"} == {
            "front/foot/gap",
            "rear/foot/gap",
        }
