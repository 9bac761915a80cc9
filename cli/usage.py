"""Usage: examples beside complaints, and forms of options that scripts still write."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperCommand


class Command(TyperCommand):
    """A command whose complaint about a missing argument ends with the example of its help, and
    about a value says what was expected, where typer leaves it to pydantic."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        try:
            return super().parse_args(ctx, args)
        except typer.BadParameter as error:
            from pydantic import ValidationError

            if isinstance(error.__cause__, ValidationError):
                from kemba.config import refused

                error.message = refused(error.__cause__)
            found = re.search(r"^Example: .+$", self.help or "", re.MULTILINE)
            if found and not error.message:  # only that of a missing argument is empty
                error.message = found[0]
            raise


TABLES = (".csv", ".parquet", ".mcap", ".mat", ".npz", ".json")  # endings of logs


def figure_at(place: str, fits: Callable[[str], bool]) -> type[Command]:
    """A command that reads `--figure PLACE` as the option `place` with that value.

    `fits`: whether the word behind `--figure` is a place, and not the next argument.
    """

    class Placed(Command):
        def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
            return super().parse_args(ctx, _moved(args, place, fits))

    return Placed


def _moved(args: list[str], place: str, fits: Callable[[str], bool]) -> list[str]:
    """The words of a command line with `--figure PLACE` and `--figure=PLACE` replaced."""
    found: list[str] = []
    for number, word in enumerate(args):
        name, is_set, value = word.partition("=")
        after = args[number + 1] if number + 1 < len(args) else "-"
        if name == "--figure" and is_set:
            found += [place, value]
        elif word == "--figure" and not after.startswith("-") and fits(after):
            found.append(place)  # the value follows by itself
        else:
            found.append(word)
    return found


def is_picture(word: str) -> bool:
    """Whether a word behind `compare --figure` is the picture's name, not a log."""
    path = Path(word)
    return path.suffix.lower() not in TABLES and not path.is_dir()


def is_new_folder(word: str) -> bool:
    """Whether a word behind `characterise --figure` is a folder for pictures, not logs."""
    path = Path(word)
    return path.suffix.lower() not in TABLES and not [
        *path.glob("*.csv"),
        *path.glob("metadata.yaml"),
    ]
