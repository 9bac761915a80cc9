"""All mistakes of a task are told in one round: of keys, values, names and changed effects."""

from pathlib import Path

import pytest

from kemba.config import load_yaml
from kemba.config.parsing import sound
from kemba.errors import ConfigErrors
from kemba.ocp import Task, load_task
from kemba.ocp.reading import asked_of

WRONG = """\
name: mine
heigth: 0.5 m
supply: 7 kg
effects:
  contact: {mu: a lot}
  frction: {c: 1}
end:
  body/x: 0 m
  body/pich: 0 deg
bounds:
  body/z: {at_most: height, at_lest: 2}
goals:
  apex: {quantity: body/y, at: middle, equals: height}
  two: {quantity: body/z, at: midle, equals: 3 kg}
cost: {torque: 1}
solver: {options: {tolerance: 1}}
"""


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    (tmp_path / "mine.yaml").write_text(WRONG, encoding="utf-8")
    return tmp_path / "mine.yaml"


def lines(error: ConfigErrors) -> list[int]:
    return [int(one.where.split(":")[1]) for one in error.errors]


def test_unknown_keys_do_not_hide_unknown_names(mine: Path) -> None:
    with pytest.raises(ConfigErrors) as caught:
        load_task(mine)
    assert lines(caught.value) == [2, 3, 11, 5, 6, 9, 13, 14, 14, 15, 16]
    text = str(caught.value)
    assert "heigth: unknown key; did you mean 'height'?" in text
    assert "unknown quantity 'body/pich'; did you mean 'body/pitch'?" in text
    assert "has no effect 'frction'" in text and "unknown cost 'torque'" in text


def test_nothing_is_said_of_what_a_wrong_key_would_have_given(mine: Path) -> None:
    """The height is misspelt: that is one mistake, and not one more at each use of it."""
    with pytest.raises(ConfigErrors) as caught:
        load_task(mine)
    assert "which the task does not give" not in str(caught.value)


def test_a_whole_task_says_what_is_not_given(mine: Path) -> None:
    goal = "goals: {apex: {quantity: body/z, at: middle, equals: height}}\n"
    mine.write_text(f"name: mine\n{goal}effects: {{contact: {{mu: a lot}}}}\n", encoding="utf-8")
    task, document = load_task(mine)
    with pytest.raises(ConfigErrors) as caught:
        asked_of(task, document)
    assert lines(caught.value) == [3, 2]
    assert "refers to 'height', which the task does not give" in str(caught.value)


def test_the_sound_part_is_what_the_schema_accepts(mine: Path) -> None:
    left = sound(load_yaml(mine), Task).data
    assert set(left) == {"name", "effects", "end", "bounds", "goals", "cost", "solver"}
    assert left["bounds"] == {"body/z": {"at_most": "height"}}
    assert left["goals"]["two"] == {"quantity": "body/z", "at": "midle", "equals": "3 kg"}
    assert Task.model_validate(left).name == "mine"


def test_a_wrong_item_of_a_list_hides_no_other_mistake(mine: Path) -> None:
    """An obstacle that ends before it begins, beside a leg, a name and a line of terrain."""
    scene = "obstacles:\n- {from: 0.1 m, to: 0.05 m, height: 5 cm}\n"
    scene += "terrain:\n- {from: 0.32 m, height: 8 cm}\n- {from: 0.33 m, height: 0.2 m}\n"
    rest = "contacts:\n- {on: [rear, frnt], share: 100 %}\nend: {'*/foot/gapp': 0 m}\n"
    mine.write_text(f"name: mine\n{scene}{rest}", encoding="utf-8")
    with pytest.raises(ConfigErrors) as caught:
        load_task(mine)
    assert sorted(lines(caught.value)) == [3, 6, 7, 9]
    assert "contacts: no leg 'frnt'; did you mean 'front'?" in str(caught.value)
