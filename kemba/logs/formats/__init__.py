"""Formats of logs: one function each that reads a file whole, and some that write one.

A reader takes a path and gives a `Recording`; its package is imported when the first such file is
opened. A new format is a line of `READERS`.
"""

from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

from kemba.errors import KembaError
from kemba.logs.recording import Recording
from kemba.logs.text import encoding
from kemba.trajectory import Trajectory

Read = Callable[[Path], Recording]
Write = Callable[[Trajectory, Path], None]

LARGEST = 2_000_000_000  # bytes of an unpacked log: 40 columns at 1 kHz for 1.7 hours
MODULES = {"parquet": "parquet", "mcap": "mcap", "mat": "arrays", "npz": "arrays", "json": "arrays"}
READERS = {
    **MODULES, "db3": "rosbag2", "mf4": "measured", "mdf": "measured", "tdms": "measured",
    "ulg": "measured", "jsonl": "arrays", "lvm": "lines", "sto": "lines", "mot": "lines",
    "h5": "arrays", "hdf5": "arrays", "hdf": "arrays",
}  # fmt: skip
UNREAD = {  # endings of files that are not read: what they are, and the way out
    "bag": ("a bag of ROS 1", "rosbags-convert --src FILE --dst FOLDER makes one of ROS 2 of it"),
    "nc": ("a NetCDF file", "write its columns as CSV or Parquet"),
    "feather arrow": ("an Arrow file", "write its table as Parquet"),
    "xlsx xls xlsm ods": ("a workbook", "save its sheet as CSV"),
    "blf": ("a log of CAN frames", "decode it with its DBC file into MDF, as asammdf does"),
    "rrd": ("a recording of Rerun", "take the log that it was made of"),
    "pkl pickle": ("a file of Python objects, which run code when read", "write it as Parquet"),
    "zip gz bz2 zst 7z tar": ("packed", "unpack it"),
}
SAME = {
    "mdf": "mf4",
    "mot": "sto",
    "jsonl": "json",
    "hdf5": "h5",
    "hdf": "h5",
}  # other endings of formats
FOLDER = "db3"  # the ending whose reader takes the folder of a rosbag2


def reader(path: Path) -> Read:
    """The function that reads a file of this ending, or a folder."""
    ending = FOLDER if path.is_dir() else _ending(path)
    module = _module(path, READERS[ending])
    found: Read = getattr(module, f"read_{SAME.get(ending, ending)}")
    return found


def writer(path: Path) -> Write:
    """The function that writes a trajectory in the format of this ending."""
    ending = _ending(path)
    found: Write = getattr(_module(path, MODULES[ending]), f"write_{ending}")
    return found


def check_read(path: Path) -> None:
    """Raises KembaError where a file is of a format that is not read, with the way out."""
    ending = path.suffix.lstrip(".").lower()
    for endings, (what, way_out) in UNREAD.items():
        if ending in endings.split():
            raise KembaError(str(path), f"is {what}, which kemba does not read", hint=way_out)
    with suppress(OSError), path.open("rb") as stream:
        text = b"\0" not in stream.read(1024) or encoding(path).startswith(("utf-16", "utf-32"))
        if ending not in READERS and not text:
            expected = f"a table of text was expected, or one of .{', .'.join(READERS)}"
            raise KembaError(str(path), "is no text, and of no format that is known", expected)


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


def _module(path: Path, name: str) -> Any:
    """The module of a format. Raises KembaError where its package is not installed."""
    try:
        return import_module(f"kemba.logs.formats.{name}")
    except ImportError as error:
        raise missing(path, error) from None


def missing(path: Path, error: ImportError) -> KembaError:
    """The error about a package that a file needs and that is not installed."""
    what = f"needs the package '{(error.name or '').split('.')[0]}', which is not installed"
    return KembaError(str(path), what, hint="pip install 'kemba[formats]'")
