"""A fault of a log, with its file, row and column."""

from __future__ import annotations

from kemba.errors import KembaError
from kemba.trajectory import Trajectory

UNMAPPED = "of a log of another program, give its source in the column map (--map)"


def log_fault(
    log: Trajectory,
    what: str,
    expected: str = "",
    hint: str = "",
    row: int | None = None,
    column: str = "",
) -> KembaError:
    """What is wrong with a log, at its place; `row` counts from 0."""
    where = log.meta.get("path", log.meta.get("name", "log"))
    if row is not None:
        names = ["time", *log.names]
        bare = column.split(" [")[0]
        at = names.index(bare) + 1 if bare in names else 1
        where = f"{where}:{row + 2}:{at}"
    return KembaError(f"{where}: {column}" if column else where, what, expected, hint)
