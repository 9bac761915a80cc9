"""Every verb says the next one, in words that the program understands."""

import inspect
import shlex
from pathlib import Path
from typing import Any

import pytest
import typer

from kemba_cli import next_steps
from kemba_cli.common import speaking
from kemba_cli.main import PANELS, app

GROUP: Any = typer.main.get_command(app)
LOGS = ["logs/a b.csv", "logs/c.csv"]
BY_NAME = {v.__name__.replace("draft_map", "map"): v for verbs in PANELS.values() for v in verbs}


@pytest.mark.parametrize("verb", BY_NAME)
def test_every_verb_says_the_next_one_or_is_the_last(verb: str) -> None:
    module = inspect.getsource(inspect.getmodule(BY_NAME[verb]))  # type: ignore[arg-type]
    says = "say_next(" in module or "say_verdict(" in module
    assert says != (verb in next_steps.LAST)


def found(folder: Path) -> list[str]:
    """All that is said to come next, of files with a space in their names."""
    run, answer = folder / "my run", folder / "my answer"
    run.mkdir()
    (run / "certificate.json").write_text("{}")
    task = {"file": "my task.yaml", "kind": "tasks"}
    checked = [{"file": log, "kind": "log"} for log in LOGS]
    return [
        *(
            next_steps.after_solve(str(run), s == "solved", s)
            for s in ("solved", "stalled", "interrupted")
        ),
        next_steps.after_simulate(LOGS, run),
        next_steps.after_simulate(LOGS, folder),
        next_steps.after_plot([run]),
        next_steps.after_map(Path(LOGS[0]), folder / "map.yaml"),
        next_steps.after_check(checked, "my map.yaml", "mine.yaml"),
        next_steps.after_check([task], None),
        next_steps.after_compare(LOGS, "map.yaml", "mine.yaml", run, explained=True),
        next_steps.after_compare(LOGS, None, "planning", None, explained=False),
        next_steps.after_discover(LOGS, "map.yaml", "mine.yaml", answer),
        next_steps.after_model(folder / "my model.yaml"),
        next_steps.after_model(folder / "my model.yaml", True, LOGS, "my map.yaml"),
        next_steps.after_experiment(folder / "next.yaml", True),
        next_steps.after_experiment(folder / "next.yaml", False),
        next_steps.after_sweep("my sweep.yaml", folder, False),
    ]


def test_what_comes_next_can_be_typed(tmp_path: Path) -> None:
    for words in found(tmp_path):
        verb, *rest = shlex.split(words)
        command = GROUP.commands[verb]
        context = command.make_context(verb, rest, resilient_parsing=True)
        assert context.args == [], words
        given = [str(value) for value in context.params.values() if value]
        assert "a b.csv" not in words or "logs/a b.csv" in "".join(given), words


def test_the_planning_model_needs_no_option_and_another_does() -> None:
    asked = next_steps.discover(["a.csv"], "map.yaml", "planning")
    assert asked == "discover a.csv --map map.yaml"
    assert "--model mine.yaml" in next_steps.discover(["a.csv"], None, "mine.yaml")
    after = next_steps.after_model(Path("mine.yaml"), True, ["a.csv"], "map.yaml")
    assert after == "compare a.csv --map map.yaml --model mine.yaml"


def test_nothing_is_said_where_nothing_follows(tmp_path: Path) -> None:
    assert next_steps.after_plot([tmp_path]) == ""
    assert next_steps.after_sweep("a.yaml", tmp_path, True) == ""
    assert next_steps.after_model(tmp_path / "rig.yaml", rig=True) == ""
    assert next_steps.after_check([{"file": "m.yaml", "kind": "robots"}], None) == ""


def test_effects_of_ones_own_go_along(capsys: pytest.CaptureFixture[str]) -> None:
    with speaking(effects=[Path("my effects.py")]):
        next_steps.say_next("solve jump.yaml")
        next_steps.say_next("")
    with speaking(effects=[Path("my effects.py")], quiet=True):
        next_steps.say_next("solve jump.yaml")
    said = capsys.readouterr().err
    assert said == "next: kemba-opt solve jump.yaml --effects 'my effects.py'\n"
