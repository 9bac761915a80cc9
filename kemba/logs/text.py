"""Text tables of other programs: any separator, decimal sign and header."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.logs.columns import ColumnMap
from kemba.trajectory import Array

Raw = dict[str, np.ndarray[Any, Any]]


def read_text(path: Path, layout: ColumnMap) -> Raw:
    """The columns of a text table as texts (n,), by header or by number from 1.

    Cells that are no numbers stay as they are: only those of mapped columns are ever converted.
    Raises KembaError where the file cannot be read or a row has more cells than the header.
    """
    import pandas as pd

    try:
        table = pd.read_csv(
            path,
            sep=layout.pattern,
            header=None,
            skiprows=layout.skip_rows,
            dtype=str,
            keep_default_na=False,
            skipinitialspace=True,
            encoding=encoding(path),
        )
    except pd.errors.EmptyDataError:
        raise KembaError(str(path), "is empty", "a table was expected") from None
    except UnicodeDecodeError:
        raise KembaError(str(path), "is not a text", "a table was expected") from None
    except pd.errors.ParserError as error:
        what = f"is no table with the separator '{layout.separator}': {error}".strip()
        raise KembaError(str(path), what, hint="`separator` and `skip_rows` of the map") from None
    except OSError as error:
        raise KembaError(str(path), error.strerror or str(error)) from None
    cells = table.to_numpy(dtype=object)
    names = [str(number) for number in range(1, cells.shape[1] + 1)]
    if layout.header:
        given = [str(cell).strip() for cell in cells[0]]
        names = [
            name if given.index(name) == i else f"{name}#{i + 1}" for i, name in enumerate(given)
        ]
    first = int(layout.header) + layout.skip_below
    return {name: cells[first:, column] for column, name in enumerate(names)}


def first_row(layout: ColumnMap) -> int:
    """The row of the file, from 1, in which the data begin."""
    return layout.skip_rows + int(layout.header) + layout.skip_below + 1


def encoding(path: Path) -> str:
    """UTF-8 or, where the file is not, the one of older Windows programs."""
    with open(path, "rb") as stream:
        start = stream.read(1 << 20)
    try:
        start.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        return "utf-8-sig" if error.start > len(start) - 4 else "cp1252"
    return "utf-8-sig"


def as_numbers(cells: np.ndarray[Any, Any], decimal: str) -> tuple[Array, Array]:
    """Numbers (n,) of texts (n,), NaN where there is none, and where a cell is neither (n,).

    `true` and `on` are 1, `false` and `off` are 0; an empty cell, `nan` or `-` is no reading.
    """
    import pandas as pd

    texts = pd.Series(cells).astype(str).str.strip().str.lower()
    texts = texts.str.replace(",", ".", regex=False) if decimal == "," else texts
    texts = texts.replace({"true": "1", "on": "1", "false": "0", "off": "0"})
    numbers = pd.to_numeric(texts, errors="coerce").to_numpy(dtype=float, copy=True)
    empty = texts.isin(["", "nan", "na", "null", "none", "-"]).to_numpy()
    return numbers, ~np.isfinite(numbers) & ~empty
