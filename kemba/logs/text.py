"""Text tables of other programs: any separator, decimal sign and header."""

import csv
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.logs.columns import ColumnMap
from kemba.logs.recording import Column, Raw
from kemba.trajectory import Array

# what programs write where there is no reading, spreadsheets for a fault too
MISSING = [
    "",
    *"nan NaN NAN na NA n/a N/A #N/A #NA <NA> NaT null NULL none None - -- #VALUE! #DIV/0!".split(),
]
PIECE = 50_000  # rows that are read at a time: their texts take more memory than the numbers
WIDE = re.compile(r"Expected (\d+) fields in line (\d+), saw (\d+)")  # pandas of a long row
COMMENT = ("#", "%", "//")  # before a header, as of numpy.savetxt


def read_text(path: Path, layout: ColumnMap) -> Raw:
    """The columns (n,) of a text table, by header or by number from 1: of numbers where all cells
    are, else of texts, of which only those of mapped columns are ever converted.

    Raises KembaError where the file cannot be read or a row has more cells than the header.
    """
    import pandas as pd

    above, names = _header(path, layout)
    try:
        pieces = list(
            pd.read_csv(
                path,
                sep=layout.pattern,
                header=None,
                skiprows=above,
                decimal=layout.decimal,
                keep_default_na=False,
                na_values=MISSING,
                skipinitialspace=True,
                encoding=encoding(path),
                chunksize=PIECE,
            )
        )
    except pd.errors.EmptyDataError:
        raise KembaError(str(path), "is empty", "a table was expected") from None
    except UnicodeDecodeError:
        raise KembaError(str(path), "is not a text", "a table was expected") from None
    except pd.errors.ParserError as error:
        hint = "`separator` and `skip_rows` of the map"
        if wide := WIDE.search(str(error)):
            width, line, count = wide.groups()
            what = f"has {count} cells in a table of {width} columns"
            raise KembaError(f"{path}:{line}", what, hint=hint) from None
        why = str(error).removeprefix("Error tokenizing data. C error: ").strip()
        what = f"is no table with the separator '{layout.separator}': {why}"
        raise KembaError(str(path), what, hint=hint) from None
    except OSError as error:
        raise KembaError(str(path), error.strerror or str(error)) from None
    width = pieces[0].shape[1]
    if width < len(names):
        what = f"rows have {width} cells below {len(names)} headers"
        raise KembaError(f"{path}:{above + 1}", what, hint="`separator` and `skip_rows` of the map")
    found = {}
    for name, column in zip(numbered(names, width), pieces[0], strict=True):
        cells = np.concatenate([piece[column].to_numpy() for piece in pieces])
        found[name] = cells if cells.dtype.kind in "fiub" else cells.astype(object)
        if cells.dtype.kind == "f" and np.isinf(cells).any():
            row = above + 1 + int(np.argmax(np.isinf(cells)))
            raise KembaError(f"{path}:{row}", f"{name}: the number is infinite")
    _check_quotes(found, path, above)
    return found


def numbered(names: Sequence[str], width: int) -> list[str]:
    """Names of so many columns: a repeated one gets its number, one without name is its number."""
    given = [*names, *[""] * (width - len(names))]
    plain = [name or str(i) for i, name in enumerate(given, start=1)]
    return [n if plain.index(n) == i else f"{n}#{i + 1}" for i, n in enumerate(plain)]


def cells_of(line: str, separator: str) -> list[str]:
    """The cells of one line, without the mark of a comment before a header."""
    line = line.strip("\r\n")
    bare = line.lstrip()
    mark = next((m for m in COMMENT if bare.startswith(m)), "")
    line = bare[len(mark) :].lstrip() if mark else line
    if separator == "whitespace":
        return line.split()
    delimiter = {"tab": "\t"}.get(separator, separator)
    if len(delimiter) != 1 or len(line) > csv.field_size_limit():
        return [cell.strip() for cell in line.split(delimiter)]
    return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]


def first_row(path: Path, layout: ColumnMap) -> int:
    """The row of the file, from 1, in which the data begin."""
    return _header(path, layout)[0] + 1


def _header(path: Path, layout: ColumnMap) -> tuple[int, list[str]]:
    """How many lines stand above the data, and the columns' names, those of several rows of a
    header joined by `/`."""
    rows, taken = list[list[str]](), layout.skip_rows
    wanted = int(layout.header) + layout.skip_below
    for number, line in lines_of(path):
        if number <= layout.skip_rows or not line.strip():
            continue
        if len(rows) == wanted:
            break
        rows.append(cells_of(line, layout.separator))
        taken = number
    if wanted and len(rows) < wanted:
        raise KembaError(str(path), "is empty", "a table was expected")
    return taken, joined(rows[: int(layout.header)])


def joined(rows: Sequence[Sequence[str]]) -> list[str]:
    """The names in so many rows of a header: `front` above `hip` is `front/hip`."""
    width = max(map(len, rows), default=0)
    filled = [[*row, *[""] * (width - len(row))] for row in rows]
    return ["/".join(filter(None, parts)) for parts in zip(*filled, strict=True)]


def lines_of(path: Path) -> Iterator[tuple[int, str]]:
    """The lines of a text, numbered from 1. Raises KembaError where it cannot be read."""
    try:
        with open(path, encoding=encoding(path), newline=None, errors="replace") as stream:
            yield from enumerate(stream, start=1)
    except OSError as error:
        raise KembaError(str(path), error.strerror or str(error)) from None


def _check_quotes(raw: Raw, path: Path, above: int) -> None:
    """Raise KembaError where a quote was opened that its own line does not close: the rows up to
    the next quote would be lost."""
    texts = {name: cells for name, cells in raw.items() if cells.dtype == object}
    for name, cells in texts.items():
        for row, cell in enumerate(cells):
            if isinstance(cell, str) and "\n" in cell:
                what = f"{name}: a quote is opened in row {above + row + 1} that is not closed"
                raise KembaError(f"{path}:{above + row + 1}", what, "one row a line was expected")


def encoding(path: Path) -> str:
    """UTF-8 or, where the file is not, the one of older Windows programs; UTF-16 by its mark."""
    with open(path, "rb") as stream:
        start = stream.read(1 << 20)
    if start[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return "utf-16"
    try:
        start.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        return "utf-8-sig" if error.start > len(start) - 4 else "cp1252"
    return "utf-8-sig"


def as_numbers(cells: Column, decimal: str) -> tuple[Array, np.ndarray[Any, Any]]:
    """Numbers (n,) of texts (n,), NaN where there is none, and where a cell is neither (n,).

    `true` and `on` are 1, `false` and `off` are 0; an empty cell, `nan` or `-` is no reading.
    """
    import pandas as pd

    texts = pd.Series(cells).astype(str).str.strip().str.lower()
    if decimal == ",":  # a point there parts thousands, and what it is in is no number
        texts = texts.str.replace(".", "?", regex=False).str.replace(",", ".", regex=False)
    texts = texts.replace({"true": "1", "on": "1", "false": "0", "off": "0"})
    numbers = pd.to_numeric(texts, errors="coerce").to_numpy(dtype=float, copy=True)
    empty = texts.isin([text.lower() for text in MISSING]).to_numpy()
    return numbers, ~np.isfinite(numbers) & ~empty
