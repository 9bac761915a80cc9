"""The part of a page that a benchmark writes."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from kemba.files import atomic_text


def put_block(page: Path, begin: str, end: str, lines: Iterable[str]) -> None:
    """Put lines between the marks `begin` and `end` of a page, in the place of what is there.

    Raises ValueError where the page lacks a mark or has it twice.
    """
    before, rest = page.read_text(encoding="utf-8").split(begin)
    _, after = rest.split(end)
    with atomic_text(page) as stream:
        stream.write("\n".join([before + begin, "", *lines, "", end]) + after)


def printed(lines: Iterable[str]) -> list[str]:
    """All lines, each printed as soon as it comes."""
    found = []
    for line in lines:
        print(line, flush=True)
        found.append(line)
    return found
