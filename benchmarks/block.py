"""The part of a page that a benchmark writes, and the record that it is written from."""

import argparse
import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from kemba.files import atomic_text
from kemba.sweep import machine

Rows = Callable[[int | None], Iterable[str]]  # the lines of the first so many tasks


def put_block(page: Path, begin: str, end: str, lines: Iterable[str]) -> None:
    """Put lines between the marks `begin` and `end` of a page, in the place of what is there.

    Raises ValueError where the page lacks a mark or has it twice.
    """
    before, rest = page.read_text(encoding="utf-8").split(begin)
    _, after = rest.split(end)
    with atomic_text(page) as stream:
        stream.write("\n".join([before + begin, "", *lines, "", end]) + after)


class Record:
    """The `rows` of a study, a line of JSON each in its file: an interrupted study goes on."""

    def __init__(self, file: Path) -> None:
        text = file.read_text(encoding="utf-8") if file.is_file() else ""
        self.file, self.rows = file, [json.loads(line) for line in text.splitlines()]

    def add(self, row: dict[str, Any]) -> None:
        """Keep a row, in the file at once, and print it."""
        line = json.dumps(row)
        print(line, flush=True)
        self.rows.append(row)
        with self.file.open("a", encoding="utf-8") as record:
            record.write(line + "\n")

    def known(self, *keys: str) -> set[tuple[Any, ...]]:
        """What the rows have under these keys."""
        return {tuple(row[key] for key in keys) for row in self.rows}

    def show(
        self, lines: list[str], page: Path | None = None, begin: str = "", end: str = ""
    ) -> None:
        """Print the table of the rows, and put it into the `page` where one is given."""
        print("\n".join(lines))
        if page is not None:
            put_block(page, begin, end, lines)


def printed(lines: Iterable[str]) -> list[str]:
    """All lines, each printed as soon as it comes."""
    found = []
    for line in lines:
        print(line, flush=True)
        found.append(line)
    return found


def table_of_tasks(
    told: str, page: Path, marks: tuple[str, str], head: Iterable[str], rows: Rows
) -> None:
    """The main function of a benchmark that plans a list of tasks: prints a table, and writes it
    into `page` between `marks` if asked to."""
    parser = argparse.ArgumentParser(description=told.splitlines()[0])
    parser.add_argument("--tasks", type=int, default=None, help="so many of the list")
    parser.add_argument("--write", action="store_true", help=f"into {page.name}")
    asked = parser.parse_args()
    table = [*head, *printed(rows(asked.tasks)), "", f"On {machine()}."]
    if asked.write:
        put_block(page, *marks, table)
