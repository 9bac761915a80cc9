"""`feet`: a task may say how high the feet are at the top instead of how high the body is."""

import math
from pathlib import Path

import numpy as np
import pytest

from kemba.errors import ConfigErrors
from kemba.model import load_model
from kemba.ocp import load_task, task_model
from kemba.ocp.certificate.status import Status
from kemba.ocp.infeasibility.checks import check_task
from kemba.ocp.planning import plan
from kemba.ocp.task.resolve import resolve
from kemba.ocp.task.templates import longest_leg, rise_of_feet, with_height


def test_a_body_at_45_cm_has_its_feet_at_1_cm() -> None:
    """As the pages say."""
    leg = longest_leg(load_model().mechanism.need_robot())
    assert math.isclose(0.45 - leg, 0.01, abs_tol=0.002)


def test_the_height_is_that_of_stretched_legs() -> None:
    task, document = load_task("jump.yaml", ["feet=8 cm"])
    assert (task.feet, task.height) == (0.08, None)
    model = task_model(task, document=document)
    height = with_height(task, model).height
    assert height == pytest.approx(0.08 + longest_leg(model.mechanism.need_robot()))
    asked = {w.location: w for w in resolve(task, model, document)}
    assert asked["goals", "apex"].lower == asked["bounds", "body/z"].upper == height
    foot = asked["feet",]
    assert (foot.at, foot.lower, foot.upper) == (0.5, 0.08, math.inf)
    assert foot.quantity.name.endswith("/foot/z")


def test_the_last_of_feet_and_height_counts_and_a_file_has_one(tmp_path: Path) -> None:
    mine = tmp_path / "mine.yaml"
    text = "name: mine\nfeet: 8 cm\ngoals: {up: {quantity: body/z, at: middle, equals: height}}\n"
    mine.write_text(text, encoding="utf-8")
    assert load_task(mine)[0].feet == 0.08
    changed = load_task(mine, ["height=0.5 m"])[0]
    assert (changed.feet, changed.height) == (None, 0.5)
    mine.write_text(f"{text}height: 0.5 m\n", encoding="utf-8")
    with pytest.raises(ConfigErrors, match="'feet' does not go with 'height'"):
        load_task(mine)
    with pytest.raises(ConfigErrors, match="'feet' does not go with 'height'"):
        load_task("jump.yaml", ["feet=8 cm", "height=0.5 m"])


def test_feet_need_a_moment_and_a_length() -> None:
    task, document = load_task("drop.yaml", ["feet=8 cm"])
    with pytest.raises(ConfigErrors, match=r"--set feet=8 cm: feet: needs a goal for body/z"):
        resolve(task, task_model(task), document)
    with pytest.raises(ConfigErrors, match=r"a length such as .* was expected"):
        load_task("jump.yaml", ["feet=8 kg"])


def test_feet_that_must_stand_cannot_rise() -> None:
    task, document = load_task("stand.yaml", ["feet=8 cm"])
    model = task_model(task)
    found = check_task(task, model, resolve(task, model, document), document)
    assert found[0].certain and "contradiction on front/foot/z" in found[0].sentence
    assert "`feet`" in found[0].sentence


def test_feet_come_so_high() -> None:
    task, document = load_task("jump.yaml", ["feet=8 cm"])
    found = plan(task, document)
    assert found.status is Status.SOLVED
    top = int(np.argmax(found.trajectory["body/z"]))
    assert all(found.trajectory[f"{leg}/foot/z"][top] >= 0.08 - 1e-6 for leg in ("front", "rear"))
    rise = rise_of_feet(found.trajectory)
    assert rise is not None and f"(feet {100 * rise:.0f} cm up)" in found.sentence
