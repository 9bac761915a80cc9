"""Names in YAML that become names of files and folders."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import AfterValidator, WithJsonSchema

LONGEST = 80  # characters; file systems allow 255 bytes, endings and numbers included
NAME = rf"\w[\w .+-]{{0,{LONGEST - 1}}}"


def check_name(name: str) -> str:
    """The name, if it can be that of a file anywhere and leads nowhere else. Raises ValueError."""
    if not re.fullmatch(NAME, name):
        shown = name if len(name) <= LONGEST else f"{name[:LONGEST]}..."
        raise ValueError(
            f"'{shown}' cannot name a file or folder; letters, digits, spaces and _ . + - were "
            f"expected, beginning with a letter or digit, at most {LONGEST} characters"
        )
    return name


FileName = Annotated[
    str, AfterValidator(check_name), WithJsonSchema({"type": "string", "pattern": f"^{NAME}$"})
]
