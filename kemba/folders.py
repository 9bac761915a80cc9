"""Places for results: numbered unless named, never overwritten, one writer at a time."""

from __future__ import annotations

import errno
import shlex
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from kemba.errors import KembaError
from kemba.files import atomic_text, write_error

if TYPE_CHECKING:
    from filelock import BaseFileLock

LOCK = ".lock"
UNFINISHED = "UNFINISHED"  # a file that stands in a folder until all results are in it
WHY = "kemba-opt writes here, or was stopped before the end: run the same command again.\n"
MANY = 4  # log names that a command still lists one by one
PROBE = 1_000_000  # bytes: about what a run folder takes, its solver's log included


YAML = (".yaml", ".yml")
ANOTHER = "give another name, or --force to replace it (in Python: force=True)"


def ended(path: str | Path, endings: Sequence[str], option: str = "") -> Path:
    """`path`, whose name ends in one of `endings`. Raises KembaError where it does not."""
    path = Path(path)
    if path.suffix.lower() not in endings:
        what = f"no format '{path.suffix}'" if path.suffix else "has no ending"
        known = " or ".join([", ".join(endings[:-1])] * (len(endings) > 1) + [endings[-1]])
        raise KembaError(f"{option} {path}".strip(), what, f"a name ending in {known} was expected")
    return path


def fresh(
    path: str | Path, force: bool = False, option: str = "", endings: Sequence[str] = ()
) -> Path:
    """`path` for a new file, which can be written, with one of `endings` where some are given.
    Raises KembaError.

    A file that is there already is kept, unless `force`.
    """
    path = Path(path)
    where = f"{option} {path}".strip()
    if path.is_dir():
        raise KembaError(where, "is a folder", "the name of a file was expected")
    if endings:
        ended(path, endings, option)
    if path.exists() and not force:
        raise KembaError(where, "exists already", hint=ANOTHER)
    try_writing(path.parent)
    return path


def place_for(
    out: str | Path | None, default: Path, force: bool = False, endings: Sequence[str] = ()
) -> Path:
    """Where a new file goes: to `out` when it is given, else to `default` or the next free name
    beside it. With `force` files are replaced. Raises KembaError as `fresh` does; without
    `endings` that of `default` is asked for.
    """
    path = out or (default if force else next_free(default))
    return fresh(path, force, endings=endings or (default.suffix,))


def next_free(path: Path) -> Path:
    """`path`, or `path-2`, `path-3`, ... (`figure-2.png`): the first that holds nothing yet."""
    number, found = 1, path
    while found.exists() and not _is_empty(found):
        number += 1
        found = path.with_name(f"{path.stem}-{number}{path.suffix}")
    return found


@contextmanager
def claimed(
    out: str | Path | None, default: str | Path, results: str, force: bool = False
) -> Iterator[Path]:
    """A folder to write results to, which no other process writes to meanwhile.

    `out`, or the first free one of `default`, `default-2`, ... Raises KembaError when `out` holds
    a finished answer (a file that matches `results`) and not `force`, when it cannot be written,
    or when another process writes to it. A folder that was left unfinished is used again: it holds
    a file `UNFINISHED` until the block has ended without an error. A folder that stays empty is
    removed at the end.
    """
    path = next_free(Path(default)) if out is None else Path(out)
    made = not path.exists()
    try_writing(path)
    lock = lock_folder(path)
    old, unfinished = _written(path, results), (path / UNFINISHED).exists()
    try:
        if old and not force and not unfinished:
            raise KembaError(str(path), f"holds results already ({min(old).name})", hint=ANOTHER)
        with atomic_text(path / UNFINISHED) as stream:
            stream.write(WHY)
        yield path
        (path / UNFINISHED).unlink(missing_ok=True)
    finally:
        if not unfinished and _written(path, results) == old:  # nothing has been written
            with suppress(OSError):
                (path / UNFINISHED).unlink(missing_ok=True)
        unlock(lock, path)
        if made and _is_empty(path):
            with suppress(OSError):
                path.rmdir()


@contextmanager
def held(folder: Path) -> Iterator[Path]:
    """A folder that no other process writes to meanwhile. Raises KembaError as `claimed` does."""
    try_writing(folder)
    lock = lock_folder(folder)
    try:
        yield folder
    finally:
        unlock(lock, folder)


def lock_folder(folder: Path) -> BaseFileLock | None:
    """Lock a folder against other processes, until `unlock` or the end of this process.

    None on a file system without locks. Raises KembaError when another process holds it.
    """
    from filelock import FileLock, Timeout

    lock = FileLock(folder / LOCK)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        what = "another kemba-opt is writing to this folder"
        hint = "wait until it has ended, or give another folder"
        raise KembaError(str(folder), what, hint=hint) from None
    except NotImplementedError:
        return None
    except OSError as error:
        if error.errno in (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP):
            return None
        raise write_error(folder, error) from None
    return lock


@contextmanager
def alone(folder: str | None) -> Iterator[None]:
    """Other processes wait here for the same folder; where it cannot be locked, or is None, nobody
    does."""
    from filelock import FileLock

    lock = None if folder is None else FileLock(Path(folder) / LOCK)
    try:
        if lock is not None:
            lock.acquire()
    except (OSError, NotImplementedError):
        lock = None
    try:
        yield
    finally:
        if lock is not None:
            lock.release()


def unlock(lock: BaseFileLock | None, folder: Path) -> None:
    """Release a folder."""
    if lock is not None:
        with suppress(OSError):
            (folder / LOCK).unlink(missing_ok=True)
            lock.release()


def try_writing(folder: str | Path) -> None:
    """Make a folder and see that files can be written there, before long work begins. Raises
    KembaError when they cannot, or when the disk is full."""
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as probe:
            probe.write(bytes(PROBE))
            probe.flush()
    except OSError as error:
        raise write_error(folder, error) from None


def _written(folder: Path, results: str) -> dict[Path, int]:
    """The files that match `results`, and when each was written [ns]."""
    return {path: path.stat().st_mtime_ns for path in folder.glob(results)}


def _is_empty(path: Path) -> bool:
    return path.is_dir() and all(item.name in (LOCK, UNFINISHED) for item in path.iterdir())


def typed(
    logs: Sequence[str | Path], column_map: str | Path | None = None, model: str | None = None
) -> str:
    """Logs as they are typed behind a verb, with the options that they need; `folder/*.csv` where
    that stands for many of them and for no other file."""
    paths, words = [str(log) for log in logs], list[str]()
    for folder in dict.fromkeys(path.rpartition("/")[0] for path in paths):
        own = [path for path in paths if path.rpartition("/")[0] == folder]
        there = {str(path) for path in Path(folder or ".").glob("*.csv")}
        all_of_it = len(own) >= MANY and there == {str(Path(path)) for path in own}
        pattern = f"{shlex.quote(folder) + '/' if folder else ''}*.csv"
        words += [pattern] if all_of_it else [shlex.quote(path) for path in own]
    options = {"--map": column_map, "--model": model}
    words += [f"{name} {shlex.quote(str(value))}" for name, value in options.items() if value]
    return " ".join(words)
