"""Parameters of a model's effects, changed by a task or by `--set`."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from kemba.errors import KembaError
from kemba.model.spec import changed_effects
from kemba.ocp import load_task, task_model
from kemba.plant.repeat import counterpart, plant_of
from kemba_cli.main import app

NAMED = "effects.contact.mu=0.6"
NUMBERED = "effects[3].mu=0.6"


@pytest.mark.parametrize("option", [NAMED, NUMBERED, "effects={contact: {mu: 0.6}}"])
def test_an_effect_is_changed_by_name_and_by_place(option: str) -> None:
    task, document = load_task("hop", [option])
    changed, plain = task_model(task, document=document), task_model(load_task("hop")[0])
    assert changed.effect("contact").mu == 0.6  # type: ignore[attr-defined]
    assert len(changed.effects) == len(plain.effects)
    others = [e for e in changed.effects if e.name != "contact"]
    assert others == [e for e in plain.effects if e.name != "contact"]


def test_changes_of_one_effect_add_up() -> None:
    (motor,) = changed_effects("planning", {"motor": {"tau_peak": 5.0}, "1": {"on": None}})
    assert motor.tau_peak == 5.0  # type: ignore[attr-defined]


def test_the_plant_is_changed_too(tmp_path: Path) -> None:
    plant = counterpart("planning", changes={"contact": {"mu": 0.6}})
    assert plant.effect("contact").mu == 0.6  # type: ignore[attr-defined]
    (tmp_path / "task.yaml").write_text("model: planning\neffects: {contact: {mu: 0.6}}\n")
    assert plant_of(tmp_path).effects == plant.effects


@pytest.mark.parametrize(
    ("option", "words"),
    [
        ("effects.contakt.mu=0.6", "has no effect 'contakt'; 0 to 6, or a name on its list, was"),
        ("effects[9].mu=0.6", "has no effect '9'"),
        ("effects.contact.mew=0.6", "mew: unknown key"),
        ("effects.contact.mu=3 m", "mu: '3 m' is a length"),
        ("effects.contact.kind=motor", "kind: 'motor' is not allowed"),
        ("effects.contact=3", "effects.contact: '3' is of the wrong kind"),
    ],
)
def test_wrong_changes_name_their_option(option: str, words: str) -> None:
    done = CliRunner().invoke(app, ["solve", "hop", "--dry-run", "--set", option])
    assert done.exit_code == 2 and done.stderr.startswith(f"--set {option}: "), done.stderr
    assert words in done.stderr


def test_wrong_changes_name_their_line(tmp_path: Path) -> None:
    path = tmp_path / "task.yaml"
    path.write_text("height: 0.35 m\neffects:\n  contact:\n    mew: 0.6\n")
    task, document = load_task(path)
    with pytest.raises(KembaError, match=rf"{path}:4:5: mew: unknown key"):
        task_model(task, document=document)
