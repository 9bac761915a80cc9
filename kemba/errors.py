"""Errors that teach: where it is, what is wrong, what was expected, what to do next."""

from __future__ import annotations

import difflib
import shlex
from collections.abc import Iterable, Sequence

LISTED = 12  # a hint with more names than this does not help
PART, FEW = 3, 4  # so many letters of a name tell it, where so few names have them


class KembaError(Exception):
    """Bad input, described so that its author can correct it.

    `where` is a file position, an option or a name; `excerpt` holds lines shown below the message.
    """

    def __init__(
        self, where: str, what: str, expected: str = "", hint: str = "", excerpt: str = ""
    ) -> None:
        super().__init__(where, what, expected, hint, excerpt)
        self.where = where
        self.what = what
        self.expected = expected
        self.hint = hint
        self.excerpt = excerpt

    def __str__(self) -> str:
        sentence = "; ".join(part for part in (self.what, self.expected, self.hint) if part)
        message = ": ".join(part for part in (self.where, sentence) if part)
        return f"{message}\n{self.excerpt}" if self.excerpt else message

    def _render_traceback_(self) -> list[str]:
        """What notebooks show: the message, without the lines of the library that raised it."""
        return [f"{type(self).__name__}: {self}"]


class ConfigErrors(KembaError):  # noqa: N818  several errors, not one
    """All the errors of one or several files, so that they can be corrected together."""

    def __init__(self, errors: Iterable[KembaError]) -> None:
        self.errors = list(errors)
        first = self.errors[0]
        super().__init__(first.where, first.what, first.expected, first.hint, first.excerpt)

    def __reduce__(self) -> tuple[type[ConfigErrors], tuple[list[KembaError]]]:
        return type(self), (self.errors,)  # errors cross process borders in sweeps

    def __str__(self) -> str:
        return "\n".join(str(error) for error in self.errors)


def listed_errors(error: KembaError) -> list[KembaError]:
    """The errors that one holds: all of several, or itself."""
    return error.errors if isinstance(error, ConfigErrors) else [error]


def map_hint(path: object) -> str:
    """What to do with the log of another program."""
    what = "for a log of another program, draft a column map"
    return f"{what}: kemba-opt map {shlex.quote(str(path))}"


def enumerated(names: Sequence[str]) -> str:
    """Names in a sentence: a, b and c."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def suggest(name: str, candidates: Iterable[str]) -> str:
    """The nearest valid name as a question, or the valid names when none is near."""
    names = sorted(set(candidates))
    if not names:
        return ""
    folded = {candidate.casefold(): candidate for candidate in names}
    near = difflib.get_close_matches(str(name).casefold(), folded, n=1)
    if near:
        return f"did you mean '{folded[near[0]]}'?"
    typed = str(name).casefold()
    parts = [name for key, name in folded.items() if typed in key] if len(typed) >= PART else []
    if 0 < len(parts) <= FEW:
        return "did you mean " + " or ".join(f"'{part}'" for part in parts) + "?"
    more = f", ... ({len(names) - LISTED} more)" if len(names) > LISTED else ""
    return "one of: " + ", ".join(names[:LISTED]) + more
