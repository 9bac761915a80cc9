"""Where an argument is missing, the example of the verb stands beside the complaint."""

from __future__ import annotations

import re
from typing import Any

import typer
from typer.core import TyperCommand


class Command(TyperCommand):
    """A command whose complaint about a missing argument ends with the example of its help."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        try:
            return super().parse_args(ctx, args)
        except typer.BadParameter as error:
            found = re.search(r"^Example: .+$", self.help or "", re.MULTILINE)
            if found and not error.message:  # only that of a missing argument is empty
                error.message = found[0]
            raise
