"""Usage: examples beside complaints, and forms of options that scripts still write."""

import re
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


class Comparing(Command):
    """A command that reads `--figure FILE`, which scripts still write, as `--out FILE`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        found: list[str] = []
        for word, after in zip(args, [*args, "-"][1:], strict=True):
            if word.startswith("--figure="):
                found += ["--out", word.partition("=")[2]]
            else:
                found.append("--out" if word == "--figure" and is_picture(after) else word)
        return super().parse_args(ctx, found)


def is_picture(word: str) -> bool:
    """Whether a word behind `--figure` is the picture's name, not a log or an option."""
    path = Path(word)
    return not (word.startswith("-") or path.suffix.lower() in TABLES or path.is_dir())
