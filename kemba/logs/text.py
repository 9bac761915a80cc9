"""Text tables of other programs: any separator, decimal sign and header."""

import csv
import re
from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.logs.columns import ColumnMap, Number
from kemba.logs.recording import Column, Raw, Recording, some
from kemba.trajectory import Array

# what programs write where there is no reading, spreadsheets for a fault too
MISSING = [
    "",
    *"nan NaN NAN na NA n/a N/A #N/A #NA <NA> NaT null NULL none None - -- #VALUE! #DIV/0!".split(),
]
# the same as Windows programs write it (`-1.#IND`, `nan(0x7ff8)`), marks, faults of spreadsheets
NO_READING = r"[+-]?(?:1\.#[a-z]+\d*|nan(?:\(\w*\))?)|[?.*\u2013\u2014-]+|#[a-zäöü/]+\d?[!?]?"
ON = "true on yes y t open opened high active enabled energized energised ja ein auf offen wahr " \
    "vrai oui ouvert si abierto aperto オン 開 开"  # fmt: skip
OFF = "false off no n f closed close shut low inactive disabled de-energized de-energised nein " \
    "aus zu geschlossen falsch faux non fermé ferme cerrado chiuso オフ 閉 关"  # fmt: skip
SWITCHED = {**dict.fromkeys(ON.split(), "1"), **dict.fromkeys(OFF.split(), "0")}
SIGNS = str.maketrans({"\u2212": "-", "\u00a0": " ", "\u202f": " ", "\u2019": "'"})
PIECE = 50_000  # rows that are read at a time: their texts take more memory than the numbers
WESTERN = 0.8  # share of the letters of a table that Western alphabets have, at least
SHOWN = 40  # characters of a line that is left out
WIDE = re.compile(r"Expected (\d+) fields in line (\d+), saw (\d+)")  # pandas of a long row
COMMENT = ("#", "%", "//")  # before a header, as of numpy.savetxt
FIRST = re.compile(r"[+-]?[\d.,]*\d[\d.,]*(?:[eEdD][+-]?\d+)?$")  # of a row that was cut off


def read_text(path: Path, layout: ColumnMap) -> Recording:
    """The columns (n,) of a text table, by header or by number from 1: of numbers where all cells
    are, else of texts, of which only those of mapped columns are ever converted. Remarks between
    the rows, below them and headers that stand there again are left out, and said.

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
    _check_quotes(found, path, above)
    return _without_remarks(found, names)


def _without_remarks(found: Raw, names: Sequence[str]) -> Recording:
    """The table without lines that are no rows, which stand as texts in its first column."""
    import pandas as pd

    columns = list(found.values())
    named = next((i for i, name in enumerate(names) if name), 0)
    if columns[0].dtype != object and columns[named].dtype != object:
        return Recording(found)
    alone = np.ones(len(columns[0]), dtype=bool)
    for cells in columns[1:]:
        alone &= pd.isna(cells)
    texts = [str(cell).strip() if isinstance(cell, str) else "" for cell in columns[0]]
    again = columns[named] == names[named] if names else False
    likely = alone | again | [text.startswith(COMMENT) for text in texts]
    said = dict[int, str]()
    for row in np.flatnonzero(likely).tolist():
        line = ["" if pd.isna(v[row]) else str(v[row]).strip() for v in columns]
        if _is_remark(line, names):
            text = next(filter(None, line))
            said[row] = " ".join("".join(filter(str.isprintable, text)).split())[:SHOWN]
    if not said:
        return Recording(found)
    left = np.delete(np.arange(len(alone)), list(said))
    listed = some([f"'{text}'" for text in said.values()], 3)
    remark = f"lines that are no rows are left out: {listed}"
    return Recording({name: cells[left] for name, cells in found.items()}, remarks=(remark,))


def _is_remark(cells: Sequence[str], names: Sequence[str]) -> bool:
    """Whether a line is no row: marked as a comment, the header again, or one text alone."""
    filled = [cell for cell in cells if cell]
    if not filled or filled[0].startswith(COMMENT) or filled == [name for name in names if name]:
        return bool(filled)
    return len(cells) > 1 and filled == [cells[0]] and not FIRST.match(cells[0])


def line_of(path: Path, layout: ColumnMap, row: int) -> int:
    """The line of the file in which a row (from 0) of the table stands."""
    above, names = _header(path, layout)
    last = above
    for number, line in lines_of(path):
        if number <= above or not line.strip():
            continue
        cells = [] if line.strip().startswith(COMMENT) else cells_of(line, layout.separator)
        padded = [*cells, *[""] * (len(names) - len(cells))]
        if cells and not _is_remark(padded, names):
            last, row = number, row - 1
        if row < 0:
            break
    return last


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
    if separator == "whitespace":  # a unit behind a blank belongs to its name
        return re.split(r"\s+(?![\[(])", line.strip()) if line.strip() else []
    delimiter = {"tab": "\t"}.get(separator, separator)
    if len(delimiter) != 1 or len(line) > csv.field_size_limit():
        return [cell.strip() for cell in line.split(delimiter)]
    return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]


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
    for row in filled[:-1]:  # a merged cell names the columns behind it too
        for i in range(1, width):
            row[i] = row[i] or row[i - 1]
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
    """UTF-8 or, where the file is not, the one of older Windows programs, Western or Japanese;
    UTF-16 by its mark or by the zeros in it."""
    with open(path, "rb") as stream:
        start = stream.read(1 << 20)
    if start[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return "utf-16" if start[2:4] != b"\0\0" else "utf-32"
    low, high = start[::2], start[1::2]
    for zeros, other, name in ((high, low, "utf-16-le"), (low, high, "utf-16-be")):
        if zeros.count(0) > WESTERN * len(zeros) and 0 not in other:
            return name
    for name in ("utf-8-sig", "cp1252", "cp932"):
        try:
            start.decode(name)
        except UnicodeDecodeError as error:
            if error.start <= len(start) - 4:
                continue
        return name
    return "latin-1"


def as_numbers(
    cells: Column, decimal: str, missing: Collection[Number] = ()
) -> tuple[Array, np.ndarray[Any, Any]]:
    """Numbers (n,) of texts (n,), NaN where there is none, and where a cell is neither (n,).

    `true`, `on` and `open` are 1, their contraries 0; an empty cell, `nan`, `-` or what is
    `missing` is no reading. Thousands may be parted, where the column shows that they are.
    """
    import pandas as pd

    texts = pd.Series(cells).astype(str).str.translate(SIGNS).str.strip().str.lower()
    plain = texts.str.replace(",", ".", regex=False) if decimal == "," else texts
    if decimal == ",":  # a point there parts thousands, and what it is in is no number
        plain = plain.where(~texts.str.contains(".", regex=False), "?")
    numbers = pd.to_numeric(plain.replace(SWITCHED), errors="coerce")
    odd = texts[~np.isfinite(numbers)]
    if len(odd):
        numbers = numbers.astype(float)
        numbers[odd.index] = _spelt_otherwise(odd, texts[np.isfinite(numbers)], decimal)
    words = [str(text).lower() for text in (*MISSING, *missing)]
    empty = texts.isin(words) | texts.str.fullmatch(NO_READING)
    values = without(numbers.to_numpy(dtype=float, copy=True), missing)
    return values, (~np.isfinite(values) & ~empty & ~np.isfinite(numbers)).to_numpy()


def without(values: Array, missing: Collection[Number]) -> Array:
    """Values (n,) with NaN where the number says that there is no reading, and where none is."""
    with suppress(ValueError):
        told = [float(value) for value in missing if _is_number(value)]
        return np.where(np.isin(values, told), np.nan, values) if told else values
    return values


def _is_number(value: Number) -> bool:
    try:
        float(value)
    except ValueError:
        return False
    return True


def _spelt_otherwise(odd: Any, known: Any, decimal: str) -> Any:
    """Numbers of texts in other spellings: with exponents of Fortran (`1.0D+03`), of base 16, or
    with parted thousands (`1.234,5`), where other cells of the column tell that they part."""
    import pandas as pd

    fortran = odd.str.replace(",", ".", regex=False) if decimal == "," else odd
    fortran = fortran.str.replace(r"^([+-]?\d*\.?\d*)d([+-]?\d+)$", r"\1e\2", regex=True)
    found = pd.to_numeric(fortran.where(fortran != odd), errors="coerce")
    based = odd.str.fullmatch(r"0x[0-9a-f]+")
    found[based] = [float(int(text, 16)) for text in odd[based]]
    mark = odd.str.extract(r"^[+-]?\d{1,3}([.,' _])\d{3}(?!\d)", expand=False)
    marks = set(mark.dropna()) - {decimal}
    if len(marks) != 1:
        return found
    (sign,) = marks
    group = rf"[+-]?[1-9]\d{{0,2}}(?:{re.escape(sign)}\d{{3}})+(?:{re.escape(decimal)}\d*)?"
    parted = odd.str.fullmatch(group)
    rest = odd[odd.str.contains(sign, regex=False) & ~parted]
    whole = odd[parted].str.count(re.escape(sign)).max() > 1
    told = whole or odd[parted].str.contains(decimal, regex=False).any() or len(known) > 0
    small = pd.to_numeric(known.str.replace(",", ".", regex=False), errors="coerce").abs() < 1000
    if told and not len(rest) and small.all():
        joined = odd[parted].str.replace(sign, "", regex=False)
        joined = joined.str.replace(",", ".", regex=False) if decimal == "," else joined
        found[parted] = pd.to_numeric(joined)
    return found
