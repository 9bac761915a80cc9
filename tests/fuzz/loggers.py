"""Logs of other programs with damage: bytes of their formats, cells of their tables."""

import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

import foreign_files
import loggers
from hypothesis import strategies as st

from fuzz.formats import Draw, as_file, as_text, damage
from kemba.errors import KembaError
from kemba.logs.foreign import raw_columns
from kemba.logs.recording import CLOCK, Recording
from kemba.trajectory import Trajectory

ROWS = 300


def _log() -> Trajectory:
    return foreign_files.robot_log(ROWS)


# of each program a file: its ending, and what writes it
PROGRAMS: dict[str, tuple[str, Callable[[Path], Path]]] = {
    "mdf": ("mf4", lambda path: loggers.mdf(_log(), path)),
    "tdms": ("tdms", lambda path: loggers.tdms(_log(), path)),
    "tdms with times": ("tdms", lambda path: loggers.tdms(_log(), path, "Time")),
    "ulog": ("ulg", lambda path: loggers.ulog(_log(), path)),
    "labview": ("lvm", lambda path: loggers.lvm(_log(), path)),
    "opensim": ("sto", lambda path: loggers.opensim(path, ROWS)),
    "bag": ("db3", lambda path: loggers.bag(path, rows=ROWS)),
    "mcap of ros": ("mcap", lambda path: loggers.mcap_of_ros2(path, ROWS)),
    "simulink": ("mat", lambda path: foreign_files.logs_out(_log(), path)),
    "simulink 7.3": ("mat", lambda path: foreign_files.logs_out(_log(), path, "v7.3")),
    "parquet": ("parquet", lambda path: foreign_files.snake(_log(), path)),
    "german": ("csv", lambda path: foreign_files.german(_log(), path)),
    "player": ("csv", lambda path: foreign_files.player(_log(), path)),
    "units below": ("csv", lambda path: foreign_files.units_below(_log(), path)),
}
BINARY = tuple(n for n, (ending, _) in PROGRAMS.items() if ending not in ("csv", "lvm", "sto"))


@cache
def whole(program: str) -> bytes:
    """A sound log of a robot as a program writes it."""
    ending, write = PROGRAMS[program]
    with tempfile.TemporaryDirectory() as folder:
        return write(Path(folder) / f"log.{ending}").read_bytes()


@st.composite
def foreign(draw: Draw, programs: tuple[str, ...] = tuple(PROGRAMS)) -> str:
    """One to three kinds of damage to the bytes of a log of one of these programs."""
    program = draw(st.sampled_from(programs))
    return as_text(PROGRAMS[program][0], damage(draw, whole(program)))


def lost(program: str, file: Path) -> str:
    """How many readings of a program's sound log are not read of the damaged one, or are made up,
    without a word; nothing where they are as many, or where it is said."""
    try:
        found = raw_columns(file, None)
    except KembaError:
        return ""
    sound = _sound(program)
    more = _readings(found) - _readings(sound)
    if program == "ulog" and _between_messages(file.read_bytes()):
        return ""  # such a file may be whole: its format has no mark of its end
    return f"{more:+d} readings" if more and found.remarks == sound.remarks else ""


def _between_messages(content: bytes) -> bool:
    """Whether a ULog ends where one of its messages does, by the lengths before them."""
    at = 16
    while at + 3 <= len(content):
        at += 3 + int.from_bytes(content[at : at + 2], "little")
    return at == len(content)


@cache
def _sound(program: str) -> Recording:
    with tempfile.TemporaryDirectory() as folder:
        return raw_columns(
            as_file(as_text(PROGRAMS[program][0], whole(program)), Path(folder)), None
        )


def _readings(found: Recording) -> int:
    clocks = {CLOCK, *found.clocks.values()}
    return sum(len(values) for name, values in found.columns.items() if name not in clocks)
