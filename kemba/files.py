"""Writing files whole or not at all, and JSON."""

from __future__ import annotations

import json
import math
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

from kemba.errors import KembaError


@contextmanager
def atomic_text(path: str | Path) -> Iterator[TextIO]:
    """A UTF-8 text file that appears under `path` only when the block ends without an error."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with open(handle, "w", encoding="utf-8", newline="\n") as stream:
            yield stream
        Path(name).chmod(_mode(path))
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def _mode(path: Path) -> int:
    """The permissions of the file to be replaced, else those `open` would give a new one."""
    if path.exists():
        return path.stat().st_mode
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask


def plain(data: Any) -> Any:
    """`data` as JSON knows it: numpy numbers and arrays unpacked, NaN and infinity as null."""
    if isinstance(data, Mapping):
        return {str(key): plain(value) for key, value in data.items()}
    if isinstance(data, (list, tuple, set, frozenset)):
        return [plain(value) for value in data]
    if hasattr(data, "tolist"):  # numpy scalars and arrays
        return plain(data.tolist())
    if isinstance(data, float) and not math.isfinite(data):
        return None
    return str(data) if isinstance(data, Path) else data


def write_json(path: str | Path, data: Any) -> None:
    """Write `data` as JSON, whole or not at all."""
    with atomic_text(path) as stream:
        json.dump(plain(data), stream, indent=2, allow_nan=False)
        stream.write("\n")


def read_json(path: str | Path) -> Any:
    """What a JSON file holds; KembaError when it cannot be read or is not JSON."""
    try:
        return json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise KembaError(str(path), error.strerror or str(error)) from None
    except json.JSONDecodeError as error:
        raise KembaError(f"{path}:{error.lineno}:{error.colno}", "is not valid JSON") from None
    except UnicodeDecodeError:
        raise KembaError(str(path), "is not a UTF-8 text", "a JSON file was expected") from None
