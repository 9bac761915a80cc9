"""Text formats with a header of their own: LabVIEW's .lvm, OpenSim's .sto and .mot."""

from contextlib import suppress
from pathlib import Path

import numpy as np

from kemba.errors import KembaError
from kemba.logs.recording import Raw, Recording
from kemba.logs.text import lines_of, numbered

LVM_END = "***End_of_Header***"


def read_lvm(path: Path) -> Recording:
    """LabVIEW measurement: the first segment; X of its first channel is the time, or its start and
    increment where no X is written. Raises KembaError where the file is of another form."""
    lines = [line for _, line in lines_of(path)]
    if not lines or not lines[0].startswith("LabVIEW Measurement"):
        raise KembaError(
            f"{path}:1", "is no LabVIEW measurement", "'LabVIEW Measurement' was expected"
        )
    ends = [i for i, line in enumerate(lines) if line.startswith(LVM_END)]
    if not ends:
        raise KembaError(str(path), f"has no line '{LVM_END}'")
    separator = "," if any(line.startswith("Separator,") for line in lines[: ends[0]]) else "\t"
    keys = _keys(lines[: ends[0]], separator)
    own = _keys(lines[ends[0] + 1 : ends[1]], separator) if len(ends) > 1 else {}
    first = ends[min(1, len(ends) - 1)] + 1
    decimal = keys.get("Decimal_Separator", ["."])[0]
    header = [cell.strip() for cell in lines[first].rstrip("\r\n").split(separator)]
    stop = next((i for i in range(first + 1, len(lines)) if not lines[i].strip()), len(lines))
    width = len([name for name in header if name != "Comment"])
    table = _table(path, lines[first + 1 : stop], separator, decimal, width, first + 2)
    said = ["only the first of its segments is read"] if len(ends) > 2 else []
    return _lvm_columns(own, header[:width], table, said)


def _lvm_columns(
    own: dict[str, list[str]], header: list[str], table: np.ndarray, said: list[str]
) -> Recording:
    units = iter(own.get("Y_Unit_Label", []))
    names = numbered(header, len(header))
    columns: Raw = {}
    found: dict[str, str] = {}
    for name, values in zip(names, table.T, strict=True):
        if name.startswith("X_Value"):
            if "time" not in columns and np.isfinite(values).all():
                columns["time"] = values
            continue
        columns[name] = values
        if unit := next(units, ""):
            found[name] = unit
    if "time" not in columns and own.get("Delta_X"):
        start = float((own.get("X0") or ["0"])[0].replace(",", "."))
        step = float(own["Delta_X"][0].replace(",", "."))
        columns = {"time": start + step * np.arange(len(table)), **columns}
    return Recording(columns, units={"time": "s", **found}, remarks=tuple(said))


def read_sto(path: Path) -> Recording:
    """OpenSim's storage: a header up to `endheader`, then names and numbers; `inDegrees` holds for
    the columns that are angles alone. Raises KembaError where the file is of another form."""
    lines = [line for _, line in lines_of(path)]
    end = next((i for i, line in enumerate(lines) if line.strip().lower() == "endheader"), None)
    if end is None or end + 1 >= len(lines):
        raise KembaError(str(path), "has no line 'endheader'", "a table of OpenSim was expected")
    above = [line.replace(" ", "").strip().lower() for line in lines[:end]]
    first = next(i for i in range(end + 1, len(lines)) if lines[i].strip())
    names = numbered(lines[first].split(), len(lines[first].split()))
    table = _table(path, lines[first + 1 :], None, ".", len(names), first + 2)
    angles = "deg" if "indegrees=yes" in above else "rad"
    return Recording(dict(zip(names, table.T, strict=True)), units={"time": "s"}, angles=angles)


def _keys(lines: list[str], separator: str) -> dict[str, list[str]]:
    pairs = (line.rstrip("\r\n").split(separator) for line in lines)
    return {cells[0].strip(): [cell.strip() for cell in cells[1:]] for cells in pairs if cells}


def _table(
    path: Path, lines: list[str], separator: str | None, decimal: str, width: int, row: int
) -> np.ndarray:
    """The numbers (n, width); an empty cell is no reading, and a comment after them is left out."""
    with suppress(ValueError):  # of whole rows; what is no number is told at its place below
        whole = (line.replace(decimal, ".") for line in lines) if decimal != "." else lines
        return np.loadtxt(whole, delimiter=separator, usecols=range(width), ndmin=2, comments=None)
    found = np.full((len(lines), width), np.nan)
    count = 0
    for line in lines:
        cells = line.rstrip("\r\n").split(separator)
        if not line.strip():
            row += 1
            continue
        if len(cells) < width:
            if line is lines[-1]:
                break  # the file was cut off here
            raise KembaError(f"{path}:{row}", f"has {len(cells)} cells below {width} names")
        for column, cell in enumerate(cells[:width]):
            text = cell.strip().replace(decimal, ".")
            try:
                found[count, column] = float(text) if text else np.nan
            except ValueError:
                where = f"{path}:{row}:{column + 1}"
                raise KembaError(where, f"'{cell.strip()}' is not a number") from None
        count, row = count + 1, row + 1
    return found[:count]
