"""Foreign columns become ours, as a map says."""

import gc
import io
import logging
import math
import sys
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from kemba.config import load_yaml
from kemba.errors import KembaError, map_hint, suggest
from kemba.folders import YAML
from kemba.logs import times
from kemba.logs.columns import AddedColumn, ColumnMap, ColumnSource, Named
from kemba.logs.formats import READERS, UNREAD, check_read, reader
from kemba.logs.recording import Column, Raw, Recording, some
from kemba.logs.text import as_numbers, line_of, read_text, without
from kemba.logs.tidy import spread
from kemba.quantity import convert
from kemba.trajectory import TIME, Array, Trajectory, check_headers, check_times, sidecar


@np.errstate(invalid="ignore", over="ignore")  # readings that cannot be are missing ones later
def mapped(raw: Recording, layout: ColumnMap, path: Path) -> Trajectory:
    """The trajectory that a map makes of the columns of a file.

    Raises KembaError where a column is absent, a cell is no number or a unit does not fit.
    """
    reader = _Reader(raw, layout, path)
    time = reader.time()
    found, said = {}, [*raw.remarks, *reader.said]
    slower = []
    for header, source in layout.columns.items():
        if header == TIME:
            continue
        values, own = reader.values(header, source), reader.own_time(source, time)
        if source.unwrap:
            before, values = values, unwrapped(values)
            turns = np.abs(np.diff((values - before)[np.isfinite(values)])) > 1e-9
            said.append(f"{header}: begins anew {np.count_nonzero(turns)} times: joined")
        hold = times.is_command(header)
        if own is not None:
            values = times.placed(time, own, values, hold)
            slower.append(str(source.names[0]))
        if source.delay:
            values = _earlier(time, values, source.delay, hold)
        found[header] = values
    if slower:
        said.append(times.merged(slower, float(np.median(np.diff(time)))))
    kept = [h.split(" [")[0] for h, s in layout.columns.items() if s.unwrap is False]
    meta = {"read": said, "kept": kept}
    return Trajectory(time, found, {**raw.meta, **{k: v for k, v in meta.items() if v}})


def unwrapped(values: Array) -> Array:
    """An angle (n,) without the leaps by whole turns; missing readings stay missing."""
    good = np.isfinite(values)
    found = np.array(values, dtype=float)
    found[good] = np.unwrap(values[good])
    return found


def wraps(values: Array) -> bool:
    """Whether an angle (n,) begins anew after each turn: it leaps by a turn, back or forth, and
    stays within one."""
    turn, known = 2 * math.pi, values[np.isfinite(values)]
    leaps = np.abs(np.diff(known))
    far = leaps[leaps > 0.5 * turn]
    within = np.ptp(known) < 1.1 * turn if len(known) else False
    return bool(within and len(far) and np.all(far > 0.75 * turn) and np.all(far < 1.1 * turn))


def _unit(header: str) -> str:
    return header[header.index("[") + 1 : -1]


class _Reader:
    """Cells of one file as numbers."""

    def __init__(self, raw: Recording, layout: ColumnMap, path: Path) -> None:
        self.raw, self.layout, self.path = raw, layout, path
        self.said: list[str] = []

    def time(self) -> Array:
        """The time (n,) in s. Stamps are counted from the first before they become floats."""
        source = self.layout.columns[TIME]
        from_first = self.layout.origin == "first"
        name = self._name(TIME, source.names[0])
        written = times.seconds(self.raw.columns[name]) if self._is_text(name) else None
        if written is not None:
            values = written
            if source.add is not None:
                parts = self._numbers(TIME, source.add.source)
                values = values + self._converted(TIME, source.add, parts)
        else:
            self._check_texts(name)
            values = np.zeros(len(self.raw.columns[name]))
            for part, at in zip((source, source.add), source.names, strict=False):
                counted, turn = times.joined(self._column(TIME, at))
                if turn:
                    self.said.append(f"{TIME}: '{at}' begins anew after {turn}: joined")
                counted = counted - (counted[0] if from_first and len(counted) else 0)
                counted = counted.astype(float)
                values = values + self._converted(TIME, part or source, counted)
        return np.asarray(source.sign * source.scale * values + source.offset_in("s"))

    def values(self, header: str, source: ColumnSource) -> Array:
        """The column (n,) in our unit."""
        if isinstance(source.source, tuple):
            parts = [self._numbers(header, name) for name in source.source]
            return np.asarray(source.sign * source.scale * pitch(*parts) + source.offset_in("rad"))
        numbers = self._numbers(header, source.source)
        if source.threshold is not None:
            return np.where(np.isnan(numbers), np.nan, source.sign * (numbers - source.level()) > 0)
        values = self._converted(header, source, numbers)
        if source.add is not None:
            added = self._numbers(header, source.add.source)
            values = values + self._converted(header, source.add, added)
        return np.asarray(source.sign * source.scale * values + source.offset_in(_unit(header)))

    def own_time(self, source: ColumnSource, time: Array) -> Array | None:
        """When readings (n,) were taken [s]; None where they share the log's clock. Raises
        KembaError where the two clocks do not run at the same time."""
        clocks = self.raw.clocks
        base = self._name(TIME, self.layout.columns[TIME].names[0])
        base = clocks.get(base, base)
        name = self._name("", source.names[0])
        own = clocks.get(name, base)
        if own == base or own not in self.raw.columns:
            return None
        stamps = [self.raw.columns[clock] for clock in (base, own)]
        theirs, ours = (np.asarray(stamp - stamps[0][0], dtype=float) for stamp in stamps)
        inside = np.mean((ours >= theirs[0]) & (ours <= theirs[-1])) if len(ours) else 0.0
        if inside < 0.5:
            what = f"the clocks '{base}' and '{own}' do not run at the same time"
            raise KembaError(str(self.path), what, "one clock, or two of one start, were expected")
        rate = (time[-1] - time[0]) / (theirs[-1] - theirs[0])
        before, after = np.minimum(ours - theirs[0], 0.0), np.maximum(ours - theirs[-1], 0.0)
        return np.asarray(np.interp(ours, theirs, time) + rate * (before + after))

    def _converted(self, header: str, source: ColumnSource | AddedColumn, values: Array) -> Array:
        unit = _unit(header)
        try:
            return convert(values, source.unit or unit, unit)
        except ValueError as error:
            what = f"map of '{header}': unit '{source.unit}' {error}"
            raise KembaError(str(self.path), what) from None

    def _name(self, header: str, source: Named) -> str:
        """The name of a column that is given by name or by its number."""
        names = list(self.raw.columns)
        if isinstance(source, int):
            if not 0 < source <= len(names):
                what = f"has {len(names)} columns; the map reads column {source} as '{header}'"
                raise KembaError(f"{self.path}:1", what)
            return names[source - 1]
        if source not in names:
            what = f"has no column '{source}', which the map reads as '{header}'"
            raise KembaError(f"{self.path}:1", what, hint=suggest(source, names))
        if any(
            name.startswith(f"{source}#") and name[len(source) + 1 :].isdigit() for name in names
        ):
            what = f"has the column '{source}' more than once"
            raise KembaError(f"{self.path}:1", what, hint="give its number from 1 as `source`")
        return source

    def _is_text(self, name: str) -> bool:
        cells = self.raw.columns[name]
        return cells.dtype == object and any(isinstance(cell, str) for cell in cells[:3])

    def _check_texts(self, name: str) -> None:
        """Raise KembaError where a cell is no time and most others are."""
        cells = self.raw.columns[name]
        if not self._is_text(name) or times.seconds(cells[:2]) is None:
            return
        odd = next((i for i, cell in enumerate(cells) if times.seconds(cells[[0, i]]) is None), 0)
        if odd:
            raise KembaError(self._place(name, odd), f"{name}: '{cells[odd]}' is no time")

    def _column(self, header: str, source: Named) -> Column:
        """The cells (n,): whole numbers as they are, which a float may not hold."""
        name = self._name(header, source)
        cells = self.raw.columns[name]
        if cells.dtype != object:
            return cells if cells.dtype.kind in "iu" else np.asarray(cells, dtype=float)
        try:
            if all(isinstance(cell, int | str) for cell in cells):
                return np.array([int(cell) for cell in cells], dtype=object)
        except ValueError:
            pass
        return self._as_numbers(cells, name)

    def _numbers(self, header: str, source: Named) -> Array:
        name = self._name(header, source)
        cells = self.raw.columns[name]
        if cells.dtype == object:
            return self._as_numbers(cells, name)
        return self._finite(without(cells.astype(float), self.layout.missing), cells, name)

    def _as_numbers(self, cells: Column, name: str) -> Array:
        numbers, wrong = as_numbers(cells, self.layout.decimal, self.layout.missing)
        if wrong.any():
            row = int(np.argmax(wrong))
            known = f"if it means that there is no reading, `missing: [{cells[row]}]` in the map"
            hint = "`decimal`, `separator` and `skip_below` of the map" if wrong.all() else known
            where = self._place(name, row)
            raise KembaError(where, f"{name}: '{cells[row]}' is not a number", hint=hint)
        return self._finite(numbers, cells, name)

    def _finite(self, numbers: Array, cells: Column, name: str) -> Array:
        """Numbers (n,). Raises KembaError where one is infinite."""
        if (wrong := np.isinf(numbers)).any():
            row = int(np.argmax(wrong))
            hint = f"if it means that there is no reading, `missing: [{cells[row]}]` in the map"
            raise KembaError(self._place(name, row), f"{name}: the number is infinite", hint=hint)
        return numbers

    def _place(self, name: str, row: int) -> str:
        """A cell of the file, by row and column from 1."""
        text = self.path.suffix.lower() in TEXTS
        line = line_of(self.path, self.layout, row) if text else row + 1
        return f"{self.path}:{line}:{list(self.raw.columns).index(name) + 1}"


def pitch(x: Array, y: Array, z: Array, w: Array) -> Array:
    """The angle (n,) by which quaternions, rounded ones too, turn about y, after yaw about z and
    before roll about x; past a quarter turn it goes on where roll and yaw are small."""
    return np.asarray(np.arctan2(2 * (w * y - z * x), w**2 + z**2 - x**2 - y**2))


def _earlier(time: Array, values: Array, delay: float, hold: bool) -> Array:
    """The column as it would be without its lag."""
    if hold:
        at = np.clip(np.searchsorted(time, time + delay, side="right") - 1, 0, len(time) - 1)
        return np.asarray(values[at])
    return np.interp(time + delay, time, values)


TEXTS = (".csv", ".txt", ".tsv", ".dat")
BINARY = tuple(f".{ending}" for ending in READERS)
ENDINGS = (*TEXTS, *BINARY, *(f".{ending}" for ending in " ".join(UNREAD).split()))
LONGEST = 200  # characters of another program's message


def log_files(paths: Iterable[str | Path]) -> list[Path]:
    """Logs; a folder that is no recording itself stands for its CSV files and the recordings in it,
    in the order of their names.

    Raises KembaError for a folder without any.
    """
    found: list[Path] = []
    for path in map(Path, paths):
        if not path.is_dir() or is_recorded(path):
            found.append(path)
            continue
        inside = sorted(p for p in path.iterdir() if p.suffix.lower() == ".csv" or is_recorded(p))
        if not inside:
            hint = "kemba-opt simulate RUN --noise writes some"
            raise KembaError(str(path), "is a folder without logs", "CSV files were expected", hint)
        found += inside
    return found


def open_log(path: Path, columns: ColumnMap | None = None, strict: bool = True) -> Trajectory:
    """The log in a file, with what its sidecar says.

    `strict=False` lets times pass that do not increase. Raises KembaError with the place of the
    first fault, and where foreign columns need a map.
    """
    if not path.is_dir() and path.suffix.lower() not in (*BINARY, *YAML) and columns is None:
        if not path.is_file():
            raise no_log(path)
        check_read(path)
        return Trajectory.read(path, strict)
    raw = raw_columns(path, columns)
    raw = replace(raw, meta={**raw.meta, **_sidecar(path)})
    log = _own(raw, path) if columns is None else mapped(raw, columns, path)
    if strict:
        check_times(log.time, str(path))
    return log


def is_recorded(path: Path) -> bool:
    """Whether a folder is one recording, as rosbag2 writes it."""
    return (path / "metadata.yaml").is_file()


def is_log_file(path: Path) -> bool:
    """Whether a path is that of a log by its ending, be it read or not, or of a recording."""
    return is_recorded(path) if path.is_dir() else path.suffix.lower() in ENDINGS


def raw_columns(path: Path, layout: ColumnMap | None) -> Recording:
    """All columns of a file as they are, and the metadata it holds. Raises KembaError."""
    if not path.is_file() and not is_recorded(path):
        raise no_log(path)
    if path.suffix.lower() in YAML:
        endings = ", ".join((*TEXTS, *BINARY))
        raise KembaError(str(path), "is a YAML file", f"a log was expected: {endings}")
    check_read(path)
    if path.is_dir() or path.suffix.lower() in BINARY:
        return spread(_binary(path), ".", str(path))
    if layout is None:
        raise KembaError(str(path), "a column map says how to read a text table")
    return spread(read_text(path, layout), layout.decimal, str(path))


def no_log(path: Path) -> KembaError:
    """The error about a log that is not there, or a folder."""
    near = list(path.parent.iterdir()) if path.parent.is_dir() else []
    hint = suggest(path.name, [other.name for other in near if is_log_file(other)])
    what = "is a folder" if path.is_dir() else "no such file"
    return KembaError(str(path), what, "a log was expected", hint)


def _binary(path: Path) -> Recording:
    """The columns (n,) of numbers or objects of a file that may be damaged."""
    raw, reason = None, ""
    with _silent():
        try:
            raw = reader(path)(path)
        except (KembaError, MemoryError):
            raise
        except Exception as error:  # readers of others' formats raise anything on such bytes
            reason = f"{type(error).__name__}: {error}"[:LONGEST]
        if raw is None:
            gc.collect()  # closes what the reader has left open, which else is said at the end
    if raw is None:
        raise KembaError(str(path), f"is damaged, or no {path.suffix} file of a log: {reason}")
    columns = {name: _cells(values) for name, values in raw.columns.items()}
    first = next(iter(columns), "")
    for name, values in columns.items():
        like = raw.clocks.get(name, name if name in raw.clocks.values() else first)
        length = len(columns[like]) if like in columns else 0
        if values.shape != (length,):
            what = f"'{name}' has the shape {values.shape}"
            raise KembaError(str(path), what, f"({length},) as '{like}' was expected")
    return replace(raw, columns=columns, meta=raw.meta if isinstance(raw.meta, dict) else {})


@contextmanager
def _silent() -> Iterator[None]:
    """No words of other packages: what they say of a file, its remarks say or its error."""
    before, hook = logging.root.manager.disable, sys.unraisablehook
    logging.disable(logging.CRITICAL)
    sys.unraisablehook = lambda _: None
    try:
        with warnings.catch_warnings(), redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")
            yield
    finally:
        logging.disable(before)
        sys.unraisablehook = hook


def _cells(values: Any) -> np.ndarray[Any, Any]:
    """Numbers as they are, dates and texts as texts."""
    cells = np.atleast_1d(np.asarray(values))
    return cells if cells.dtype.kind in "fiubO" else cells.astype(str).astype(object)


def _own(raw: Recording, path: Path) -> Trajectory:
    if TIME not in raw.columns:
        what = f"has no column '{TIME}'; it holds {held(raw.columns)}"
        raise KembaError(str(path), what, hint=map_hint(path))
    numbers = {name: found for name, v in raw.columns.items() if (found := _numbers(v)) is not None}
    if TIME not in numbers or raw.units.get(TIME, "s") != "s":
        raise KembaError(str(path), f"'{TIME}' holds no numbers", hint=map_hint(path))
    check_headers([TIME, *(n for n in numbers if n != TIME)], path, lambda _: str(path))
    for name, values in numbers.items():
        if np.isinf(values).any():
            row = int(np.argmax(np.isinf(values))) + 1
            raise KembaError(str(path), f"'{name}' is infinite in row {row}")
    said = {"read": list(raw.remarks)} if raw.remarks else {}
    return Trajectory(numbers.pop(TIME), numbers, {**raw.meta, **said})


def held(columns: Raw) -> str:
    """What a file holds, in words."""
    return some([f"'{name}'" for name in columns])


def _numbers(values: np.ndarray[Any, Any]) -> Array | None:
    """A column as numbers; None where it holds texts."""
    if values.dtype == object and not all(isinstance(v, int | float) for v in values):
        return None
    try:
        return np.asarray(values, dtype=float)
    except OverflowError:
        return None


def _sidecar(path: Path) -> dict[str, Any]:
    found = load_yaml(sidecar(path)).data if sidecar(path).is_file() else {}
    return found if isinstance(found, dict) else {}
