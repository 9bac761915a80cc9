"""Mistakes in YAML files, as newcomers make them: the answer says where, and what was expected."""

from pathlib import Path

import pytest
from strangers.walk import typed

ROOT = Path(__file__).parents[2]
LEG = "{hip: 0.1 m, fold: 1}"
# file -> what is written in it, and the sentence
MISTAKES = {
    "four_legs.yaml": (
        f"name: x\nlegs:\n  a: {LEG}\n  b: {LEG}\n  c: {LEG}\n  d: {LEG}\n",
        "four_legs.yaml:2:1: legs: has 4 entries (a, b, c, d); at most 3 were expected",
    ),
    "no_blocks.yaml": (
        "name: x\nseed: 1\n",
        "no_blocks.yaml: blocks: missing; needed: what is to be solved or executed, block by block",
    ),
    "effects.yaml": (
        "name: x\nbase: planning\neffects:\n  - {kind: seal_frictoin, F_c: 3 N}\n",
        "effects.yaml:4:6: effects[0].kind: unknown kind 'seal_frictoin'; did you mean "
        "'seal_friction'?",
    ),
    "no_kind.yaml": (
        "name: x\nbase: planning\neffects:\n  - {F_c: 3 N}\n",
        "no_kind.yaml:4:5: effects[0].kind: missing; it says what this item is",
    ),
    "number.yaml": (
        "name: x\nbase: planning\neffects:\n  - 7\n",
        "number.yaml:4:5: effects[0]: '7' is of the wrong kind; a group of keys was expected",
    ),
    "unit.yaml": (
        "name: x\nmodel: planning\nheight: 0.6 s\n",
        "unit.yaml:3:1: height: '0.6 s' is a time; a length such as '0.5 m' was expected",
    ),
    "empty_goal.yaml": (
        "start: {}\ngoals: {apex: {}}\n",
        "empty_goal.yaml:2:9: goals.apex.quantity: missing; this file needs it",
    ),
    "space.yaml": ("name: x\nheight:0.5 m\n", "a space is missing behind the colon in line 2"),
}


@pytest.mark.nightly
@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_answered_at_its_line(name: str, tmp_path: Path) -> None:
    text, sentence = MISTAKES[name]
    (tmp_path / name).write_text(text, encoding="utf-8")
    said = typed(f"kemba-opt check {name}", tmp_path, code=2)
    assert sentence in said
    assert len(said.splitlines()) <= 6, "a mistake is not buried"


# what is typed in a folder with the log jump.csv, and the sentence
TYPED = {
    "map jmp.csv": "jmp.csv: no such file; a log was expected; did you mean 'jump.csv'?",
    "map .": ".: is a folder; a log was expected; one of: jump.csv",
    "compare jmp.csv": "jmp.csv: no such file; a log was expected; did you mean 'jump.csv'?",
    "check jump.csv": "draft a column map: kemba-opt map jump.csv",
    "discover jump.csv --map nomap.yaml": "nomap.yaml: no such file",
    "solve jumb.yaml": "did you mean 'jump.yaml'?",
    "simulate run-9": "run-9: no such run folder or table; make one with: kemba-opt solve",
    "adopt answr": "answr: holds no answer.json; make one with: kemba-opt discover",
    "effects seal_fricton": "did you mean 'seal_friction'?",
}


@pytest.mark.nightly
@pytest.mark.parametrize("command", TYPED)
def test_a_mistyped_command_is_answered(command: str, tmp_path: Path) -> None:
    (tmp_path / "jump.csv").write_text("t,height\n" + "0.1,2\n" * 9, encoding="utf-8")
    said = typed(f"kemba-opt {command}", tmp_path, code=2)
    assert TYPED[command] in said and "Traceback" not in said


def test_hard_sentences_stand_nowhere_in_the_source() -> None:
    """Those that are one text in the code; for those that are put together the walks look."""
    words = ["gives different values", "within their usual tolerance", "tolerance asked for"]
    for file in [*ROOT.glob("kemba/**/*.py"), *ROOT.glob("cli/**/*.py")]:
        text = file.read_text(encoding="utf-8")
        assert not [word for word in words if word in text], file
