"""Binary formats of logs: Parquet, MCAP, MATLAB, NumPy and JSON, each read and written whole."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from kemba.errors import KembaError
from kemba.logs.text import Raw
from kemba.trajectory import Trajectory

Read = Callable[[Path], tuple[Raw, dict[str, Any]]]
Write = Callable[[Trajectory, Path], None]

LARGEST = 2_000_000_000  # bytes of an unpacked log: 40 columns at 1 kHz for 1.7 hours
MODULES = {"parquet": "parquet", "mcap": "mcap", "mat": "matlab", "npz": "arrays", "json": "arrays"}


def reader(path: Path) -> Read:
    """The function that reads a file of this ending: its columns, and its metadata."""
    found: Read = getattr(_module(path), f"read_{_ending(path)}")
    return found


def writer(path: Path) -> Write:
    """The function that writes a trajectory in the format of this ending."""
    found: Write = getattr(_module(path), f"write_{_ending(path)}")
    return found


def check_size(path: Path, unpacked: int) -> None:
    """Raises KembaError where a packed log would unpack to more bytes than a log may have: a few
    kilobytes of zeros can be packed that fill any memory."""
    if unpacked > LARGEST:
        raise KembaError(
            str(path),
            f"unpacks to {unpacked / 1e9:.3g} GB; {LARGEST / 1e9:.0f} GB are allowed",
            "cut it into logs of single runs",
        )


def _ending(path: Path) -> str:
    return path.suffix.lstrip(".").lower()


def _module(path: Path) -> Any:
    """The module of a format. Raises KembaError where its package is not installed."""
    try:
        return import_module(f"kemba.logs.formats.{MODULES[_ending(path)]}")
    except ImportError as error:
        what = f"needs the package '{(error.name or '').split('.')[0]}', which is not installed"
        raise KembaError(str(path), what, hint="pip install 'kemba[formats]'") from None
