"""Usage: examples beside complaints, and forms of options that scripts still write."""

import re
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperCommand

UsageError: Any = typer.BadParameter.__mro__[1]  # click's, of which typer has a copy since 0.26


class Command(TyperCommand):
    """A command whose complaint about a missing argument ends with the example of its help, about
    a value says what was expected, where typer leaves it to pydantic, and about an unknown option
    names the nearest one, if it is near, or `--set`, by which keys of a task are changed."""

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
        except UsageError as error:
            typed = getattr(error, "option_name", "").lstrip("-")
            if not typed or not hasattr(error, "possibilities"):
                raise
            known = {o.lstrip("-"): o for parameter in self.params for o in parameter.opts}
            near = [f"did you mean {known[name]}?" for name in get_close_matches(typed, known, n=1)]
            key = [f"a key of the task is changed by --set '{typed}=VALUE'"] * ("set" in known)
            error.message = "; ".join([error.message, *(near or key)])
            error.possibilities = []
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
