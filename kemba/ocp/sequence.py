"""The motions of a sequence, read from their files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from kemba.config import Document, apply_overrides, beside, find_config, load_yaml
from kemba.errors import KembaError
from kemba.ocp.reading import read_task
from kemba.ocp.task.task import Task

DEEPEST = 5  # sequences within sequences
# what a sequence gives to all of its motions
GIVEN = ("model", "plant", "supply", "payload", "effects")


def motions(
    task: Task, document: Document, within: Sequence[str] = ()
) -> list[tuple[Task, Document]]:
    """The motions of a sequence in order, repeated ones as often as asked, with their documents.

    Raises KembaError, at the line of the sequence, for a file that is missing or names itself.
    """
    found: list[tuple[Task, Document]] = []
    for i, part in enumerate(task.sequence):
        place = ("sequence", i)
        try:
            file = str(find_config(beside(part.motion, _folder(document)), "tasks"))
        except KembaError as error:
            raise document.error(place, f"sequence: {error.what}", hint=error.hint) from None
        if file in within or len(within) >= DEEPEST:
            raise document.error(place, f"sequence: {part.motion} leads back to itself")
        settings = [f"{key}={value}" for key, value in part.set.items()]
        own = apply_overrides(load_yaml(file), settings)
        read = read_task(own)
        given = {key: getattr(task, key) for key in GIVEN if key in task.model_fields_set}
        read = read.model_copy(update=given)
        inner = motions(read, own, (*within, file)) if read.sequence else [(read, own)]
        found += inner * part.repeat
    return found


def _folder(document: Document) -> Path:
    return Path(document.source).parent if document.source else Path()
