"""The tutorial, typed as it stands: what it prints is what the page shows."""

from pathlib import Path

import pytest
import tutorial


def test_the_page_is_read_as_it_is_typed() -> None:
    typed = tutorial.typed(tutorial.PAGE.read_text(encoding="utf-8"))
    commands = [one.command for one in typed]
    assert sum(" solve " in command for command in commands) == 8
    assert sum(" discover " in command for command in commands) == 4
    assert any(command.startswith("for machine in") for command in commands)
    answers = [one for one in typed if " discover " in one.command]
    assert all(one.shown.splitlines()[0].endswith(".") for one in answers)


@pytest.mark.parametrize(
    ("printed", "same"),
    [
        ("Missing: delay (dt = 0.00193 s); from 1.03 to 0.84", True),
        ("Missing: delay (dt = 0.00251 s); from 1.02 to 0.84", False),  # beyond 10 %
        ("Missing: friction (dt = 0.00191 s); from 1.02 to 0.84", False),
        ("Missing: delay (dt = 0.00191 s); from 1.02 to 0.84\nmore", False),
    ],
)
def test_numbers_may_differ_a_little_and_words_not(printed: str, same: bool) -> None:
    page = "Missing: delay (dt = 0.00191 s); from 1.02 to 0.84"
    assert (tutorial.differences(page, printed) == []) is same


def test_unlikely_effects_may_change_places() -> None:
    page = "Missing.\n  99.2 %  seal_friction  F = 9\n   0.1 %  sensor_scale  k = 1"
    again = "Missing.\n  99.1 %  seal_friction  F = 9\n   0.4 %  stribeck_friction  F = 5"
    assert tutorial.differences(page, again) == []
    assert tutorial.differences(page, again.replace("seal", "dry"))


@pytest.mark.nightly
def test_the_tutorial_comes_out_as_shown(tmp_path: Path) -> None:
    room, wrong = tutorial.Room(tmp_path), []
    for one in tutorial.typed(tutorial.PAGE.read_text(encoding="utf-8")):
        printed = room.run(one.command).shown
        if one.shown:
            wrong += tutorial.differences(one.shown, printed)
    assert not wrong, "\n".join(wrong)
