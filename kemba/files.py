"""Writing files whole or not at all, and JSON."""

import errno
import hashlib
import json
import math
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

from kemba.errors import KembaError


class WriteError(KembaError):
    """A file or folder that cannot be written: another place is needed."""


class DiskFull(WriteError):  # noqa: N818
    """There is no space left: the command was right and can be repeated later."""


def sha256(path: str | Path) -> str:
    """The hash of a file's content."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def write_error(path: str | Path, error: OSError) -> WriteError:
    """Why `path` cannot be written, and what to do about it."""
    what = f"cannot be written: {error.strerror or error}"
    if error.errno in FULL:
        return DiskFull(str(path), what, hint="free some space on this disk, then run it again")
    return WriteError(str(path), what, hint="give a place where you may write files")


@contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """A name to write to; the file appears under `path` only when the block ends without an error.
    Raises WriteError when the disk is full or the folder cannot be written."""
    path = Path(path)
    temporary: Path | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(
            dir=path.parent, prefix=f".{path.name[:100]}.", suffix=path.suffix
        )
        os.close(handle)
        temporary = Path(name)
        yield temporary
        temporary.chmod(_mode(path))
        temporary.replace(path)
    except BaseException as error:
        if temporary is not None:
            temporary.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise write_error(path, error) from None
        raise


@contextmanager
def atomic_text(path: str | Path) -> Iterator[TextIO]:
    """A UTF-8 text file that appears under `path` only when the block ends without an error. Raises
    WriteError when the disk is full or the folder cannot be written."""
    with (
        atomic_path(path) as temporary,
        temporary.open("w", encoding="utf-8", newline="\n") as stream,
    ):
        yield stream


def _mode(path: Path) -> int:
    """The permissions of the file to be replaced, else those `open` would give a new one."""
    if path.exists():
        return path.stat().st_mode
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask


def plain(data: Any) -> Any:
    """`data` as JSON can hold it: numpy numbers and arrays unpacked, NaN and infinity as null."""
    if isinstance(data, Mapping):
        return {str(key): plain(value) for key, value in data.items()}
    if isinstance(data, (list, tuple, set, frozenset)):
        return [plain(value) for value in data]
    if hasattr(data, "tolist"):  # numpy scalars and arrays
        # the sum is quick, and finite only where each number is
        numbers = getattr(getattr(data, "dtype", None), "kind", "") == "f"
        finite = numbers and math.isfinite(data.sum())
        return data.tolist() if finite else plain(data.tolist())
    if isinstance(data, float) and not math.isfinite(data):
        return None
    return str(data) if isinstance(data, Path) else data


def write_json(path: str | Path, data: Any) -> None:
    """Write `data` as JSON, whole or not at all."""
    with atomic_text(path) as stream:
        json.dump(plain(data), stream, indent=2, allow_nan=False)
        stream.write("\n")


def read_json(path: str | Path) -> Any:
    """What a JSON file holds. Raises KembaError where it cannot be read or is not JSON."""
    try:
        return json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise KembaError(str(path), error.strerror or str(error)) from None
    except json.JSONDecodeError as error:
        raise KembaError(f"{path}:{error.lineno}:{error.colno}", "is not valid JSON") from None
    except UnicodeDecodeError:
        raise KembaError(str(path), "is not a UTF-8 text", "a JSON file was expected") from None
