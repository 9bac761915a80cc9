"""Logs as named arrays: NumPy .npz, JSON, HDF5, MATLAB files with structs and Simulink objects."""

import json
import re
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.files import atomic_path, plain
from kemba.files import write_json as write_json_file
from kemba.logs.draft.words import named_unit
from kemba.logs.formats import check_size, missing
from kemba.logs.recording import Column, Group, Raw, Recording, by_length, is_clock, recording, some
from kemba.logs.times import seconds
from kemba.trajectory import TIME, Trajectory

SPACE = re.compile(r"[ \t\n\r]*")
BROKEN = (ValueError, TypeError, KeyError, EOFError, NotImplementedError, zipfile.BadZipFile)


def write_npz(trajectory: Trajectory, path: Path) -> None:
    """One array per column by name, and `units` and `meta` (JSON)."""
    units = np.array([trajectory.unit(name) for name in trajectory.names])
    meta = np.array(json.dumps(plain(trajectory.meta)))
    content: dict[str, Any] = {"time": trajectory.time, "units": units, "meta": meta}
    content |= dict(trajectory.items())
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(stream, **content)


def read_npz(path: Path) -> Recording:
    """Our own .npz by its units; else every vector of numbers. Raises KembaError if damaged."""
    try:
        with zipfile.ZipFile(path) as packed:
            check_size(path, sum(member.file_size for member in packed.infolist()))
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
            content = {name: file[name] for name in file.files}
    except (*BROKEN, OSError) as error:
        raise KembaError(str(path), f"is no .npz file of numbers: {error}") from None
    if "units" not in content or "time" not in content:
        return vectors(content, path)
    names = [name for name in content if name not in ("time", "units", "meta")]
    units = np.atleast_1d(content["units"]).tolist()
    if len(units) != len(names):
        raise KembaError(str(path), f"has {len(units)} units for {len(names)} columns")
    pairs = zip(names, units, strict=True)
    columns = {f"{name} [{unit}]": content[name] for name, unit in pairs}
    return Recording({TIME: content["time"], **columns}, metadata(content.get("meta")))


def write_json(trajectory: Trajectory, path: Path) -> None:
    """Columns by header, and the metadata."""
    columns = {TIME: trajectory.time, **trajectory.columns}
    write_json_file(path, {"columns": columns, "meta": trajectory.meta})


def read_json(path: Path) -> Recording:
    """Columns by name, under `columns` or at the top, or rows: a list of objects, or one a line.
    null is a missing reading. Raises KembaError where the file is none of these."""
    try:
        text = path.read_text(encoding="utf-8")
        content = _rows(text) or _content(text)
        columns = content.get("columns", content)
        if not isinstance(columns, dict):  # pandas: orient="split"
            columns = {
                str(n): _array(list(v)) for n, v in zip(columns, content["data"].T, strict=True)
            }
        found = {k: _array(v) for k, v in columns.items() if isinstance(v, list | np.ndarray)}
    except OSError as error:
        raise KembaError(str(path), error.strerror or str(error)) from None
    except (KeyError, AttributeError):
        raise KembaError(str(path), "is no JSON of columns or rows") from None
    except (ValueError, TypeError, RecursionError) as error:
        raise KembaError(str(path), f"is no JSON of columns or rows: {error}") from None
    meta = content.get("meta", {})
    return replace(vectors(found, path), meta=meta if isinstance(meta, dict) else {})


def vectors(content: Mapping[str, Any], path: Path) -> Recording:
    """Vectors of numbers, and the columns of matrices: under the names in a list of texts as long,
    else by number. Raises KembaError where there are none, with what the file holds."""
    arrays = {name: np.squeeze(np.asarray(value)) for name, value in content.items()}
    found: Raw = {}
    lengths = {len(a) for a in arrays.values() if a.ndim == 1 and a.dtype.kind in "fiub"}
    for name, array in arrays.items():
        if array.dtype.names:
            arrays_of = {f"{name}/{key}": array[key] for key in array.dtype.names}
            found |= {
                key: a for key, a in arrays_of.items() if a.ndim == 1 and a.dtype.kind in "fiub"
            }
        elif array.dtype.kind not in "fiub":
            if (
                array.ndim == 1
                and len(array) > 2
                and (seconds(array) is not None or len(array) in lengths)
            ):
                found[name] = array.astype(object)
        elif array.ndim == 1:
            found[name] = array
        elif array.ndim == 2 and min(array.shape) > 1:
            found |= _matrix(name, array, arrays)
    if not any(len(array) for array in found.values()):
        held = some([f"'{n}' of shape {a.shape}" for n, a in arrays.items()])
        what = f"holds no vector of numbers: {held or 'nothing at all'}"
        raise KembaError(str(path), what, "one for each column was expected")
    return by_length(found)


def _matrix(name: str, array: Column, arrays: Mapping[str, Column]) -> Raw:
    """The columns of a matrix (n, k) or (k, n)."""
    tall = array if array.shape[0] >= array.shape[1] else array.T
    texts = [a for a in arrays.values() if a.dtype.kind == "U" and a.shape == (tall.shape[1],)]
    names = [str(n).strip() for n in texts[0]] if texts else []
    if len(set(names)) != tall.shape[1]:
        names = [f"{name}/{i}" for i in range(1, tall.shape[1] + 1)]
    return {label: tall[:, i] for i, label in enumerate(names)}


def _rows(text: str) -> dict[str, Any]:
    """The columns of a JSON text of rows; none where it is an object of columns."""
    first, _, more = text.strip().partition("\n")
    try:
        start = json.loads(first) if first[:1] == "{" and more else None
    except ValueError:  # an object goes on in the next line
        start = None
    if first[:1] != "[" and start is None:
        return {}
    rows = (
        [json.loads(line) for line in text.splitlines() if line.strip()]
        if start
        else json.loads(text)
    )
    if not rows or not all(isinstance(row, dict) for row in rows):
        raise ValueError("a list of objects was expected")
    flat = [dict(_leaves(row)) for row in rows]
    names = dict.fromkeys(name for row in flat for name in row)
    return {name: [row.get(name) for row in flat] for name in names}


def _leaves(row: dict[str, Any], path: str = "") -> Iterator[tuple[str, Any]]:
    """What an object holds by `path/key`."""
    for key, value in row.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{path}{key}/")
        elif not isinstance(value, list):
            yield f"{path}{key}", value


def _content(text: str) -> dict[str, Any]:
    """The object of a JSON text, lists of columns as arrays: a list takes four times as much memory
    as its array, and so only one is there at a time. Raises ValueError."""
    found, end = _members(text, 0)
    if text[end:].strip():
        raise ValueError(f"more behind its end, at {end}")
    return found


def _members(text: str, at: int) -> tuple[dict[str, Any], int]:
    """The members of the object that begins at `at`, of its `columns` alike, and where it ends."""
    decode, found = json.JSONDecoder().raw_decode, dict[str, Any]()

    def after(mark: str, at: int) -> int:
        begin = _begin(text, at)
        if text[begin : begin + 1] != mark:
            raise ValueError(f"'{mark}' was expected at {begin}")
        return _begin(text, begin + 1)

    at = after("{", at)
    while text[at : at + 1] != "}":
        at = after(",", at) if found else at
        key, at = decode(text, at)
        at = after(":", at)
        inner = key == "columns" and text[at : at + 1] == "{"
        value, at = _members(text, at) if inner else decode(text, at)
        with suppress(ValueError, TypeError):
            value = _array(value) if isinstance(value, list) else value
        if not isinstance(key, str):
            raise ValueError(f"the name of a column was expected before {at}")
        found[key], at = value, _begin(text, at)
    return found, at + 1


def _begin(text: str, at: int) -> int:
    """Where the next thing begins that is no space."""
    match = SPACE.match(text, at)
    return match.end() if match else at


def _array(values: list[Any] | Column) -> Column:
    """A list of JSON as an array: of numbers that no float holds, else of floats, else of texts."""
    if isinstance(values, np.ndarray):
        return values
    if values and all(isinstance(value, str) for value in values):
        return np.array(values)
    if values and all(type(value) is int for value in values):
        return np.array(values)
    try:
        return np.array(values, dtype=float)
    except (ValueError, TypeError):  # texts, some of them missing
        if all(isinstance(value, list) for value in values):
            return np.array(values, dtype=object)
        return np.array(["" if value is None else str(value) for value in values])


def metadata(text: Any) -> dict[str, Any]:
    """The metadata in a text of JSON; none where it is no such text."""
    try:
        found = json.loads(str(text))
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


LONGEST = 120.0  # s that reading one file may take
EXPECTED = {  # by ending
    ".mat": "a MATLAB file was expected: save(..., '-v7')",
    ".h5": "a file of HDF5 was expected, with an array for each column",
}
WAY_OUT = "in MATLAB: s = struct('time', ts.Time, 'q', ts.Data); save('log.mat', '-struct', 's')"


def plain_name(name: str) -> str:
    """A name that every language accepts: `front_hip_tau`."""
    return re.sub(r"\W", "_", name)


def write_mat(trajectory: Trajectory, path: Path) -> None:
    """One array per column as `front_hip_tau`, and `units`, `headers` and `meta` (JSON)."""
    from scipy.io import savemat

    values = {plain_name(name): trajectory[name] for name in trajectory.names}
    units = {plain_name(name): trajectory.unit(name) for name in trajectory.names}
    headers = np.array([TIME, *trajectory.headers], dtype=object)
    content = {"time": trajectory.time, **values, "units": {"time": "s", **units}}
    content |= {"headers": headers, "meta": json.dumps(plain(trajectory.meta))}
    with atomic_path(path) as temporary:
        savemat(temporary, content, appendmat=False, oned_as="column", long_field_names=True)


def read_mat(path: Path) -> Recording:
    """Our own .mat by its headers; else every series that has its times, wherever in structs,
    cells and objects it stands, and every loose vector. Raises KembaError where there is none."""
    index, arrays = _sorted_out(path)
    loose = {name: arrays[f"a{at}"] for name, at in index["loose"]}
    if "headers" in loose:
        headers = [str(header) for header in np.atleast_1d(loose["headers"])]
        return Recording(_own(headers, loose, path), metadata(loose.get("meta")))
    if not index["series"]:
        try:
            return vectors(loose, path)
        except KembaError as error:
            classes = ", ".join(index["classes"])
            what = f"{error.what}; it has objects of {classes}" if classes else error.what
            raise KembaError(
                error.where, what, "a timeseries, or a vector a column", WAY_OUT
            ) from None
    groups: dict[int, Raw] = {}
    other = list[str]()
    for name, time, values in index["series"]:
        parts = _parts(name, arrays[f"a{values}"], len(arrays[f"a{time}"]))
        groups.setdefault(time, {}).update(parts)
        other += [] if parts else [name]
    found = [Group("", arrays[f"a{time}"], "s", columns) for time, columns in groups.items()]
    left = [name for name, array in loose.items() if array.dtype.kind in "fiub" and array.ndim == 1]
    said = [f"left out, since they have no times: {some(left)}"] if left else []
    if other:
        said.append(f"left out, since they are not as long as their times: {some(other)}")
    if index["warnings"]:
        said.append(f"damaged, or of a newer MATLAB: {'; '.join(index['warnings'][:3])}")
    return recording(found, said)


def read_h5(path: Path) -> Recording:
    """HDF5 of any program: of each group its vectors and matrices that are as long as its vector
    called a time; without any such, all as in `vectors`. Raises KembaError where there is none."""
    index, arrays = _sorted_out(path)
    loose = {name: np.squeeze(arrays[f"a{at}"]) for name, at in index["loose"]}
    clocks: dict[str, str] = {}
    for name, array in loose.items():
        parent, _, last = name.rpartition("/")
        if is_clock(last, array):
            clocks.setdefault(parent, name)
    if not clocks:
        found = vectors(loose, path)
        return replace(found, units={n: u for n, u in index["units"].items() if n in found.columns})
    groups: dict[str, Group] = {}
    for parent, clock in clocks.items():
        unit = index["units"].get(clock) or named_unit(clock)[1] or ""
        groups[parent] = Group(parent, loose.pop(clock), unit, {})
    left = []
    for name, array in loose.items():
        parent, _, last = name.rpartition("/")
        group = groups.get(parent)
        rows = len(group.time) if group else 0
        parts = _parts(last, array, rows) if rows in array.shape and array.dtype.kind != "U" else {}
        if group is not None and parts:
            group.columns.update(parts)
            group.units.update(dict.fromkeys(parts, index["units"].get(name, "")))
        elif array.ndim and array.dtype.kind != "U":
            left.append(name)
    said = [f"left out, since they have no times: {some(left)}"] if left else []
    return recording([group for group in groups.values() if group.columns], said)


def _parts(name: str, values: Column, rows: int) -> Raw:
    """The columns of a signal (n,), (n, k) or (k, n)."""
    if values.ndim == 1:
        return {name: values} if len(values) == rows else {}
    flat = values.reshape(rows, -1) if values.shape[0] == rows else values.reshape(-1, rows).T
    return {f"{name}/{i}": column for i, column in enumerate(flat.T, start=1)}


def _sorted_out(path: Path) -> tuple[dict[str, Any], dict[str, Column]]:
    """What each array is, and the arrays, read by another process: damaged files may kill it."""
    try:
        with path.open("rb"):
            pass
    except OSError as error:
        raise KembaError(str(path), error.strerror or str(error)) from None
    with tempfile.TemporaryDirectory(prefix="kemba-") as folder:
        return _by_child(path, Path(folder) / "arrays")


def _by_child(path: Path, written: Path) -> tuple[dict[str, Any], dict[str, Column]]:
    script = Path(__file__).with_name("mat_child.py")
    child = [sys.executable, str(script), str(path.resolve()), str(written)]
    matlab = path.suffix.lower() == ".mat"
    expected = EXPECTED[".mat" if matlab else ".h5"]
    try:
        done = subprocess.run(
            child, stdin=subprocess.DEVNULL, capture_output=True, timeout=LONGEST, check=False
        )
    except subprocess.TimeoutExpired:
        what = f"cannot be read within {LONGEST:g} s"
        raise KembaError(str(path), what, expected) from None
    if done.returncode:
        said = done.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        if said == "PACKAGE" and not matlab:
            raise missing(path, ImportError(name="h5py"))
        if said == "PACKAGE":
            if sys.version_info < (3, 11):
                what = "holds objects of MATLAB, which mat-io reads with Python 3.11 or newer"
                raise KembaError(str(path), what, hint="save structs of numbers, as version 7")
            raise missing(path, ImportError(name="mat-io"))
        reason = said if done.returncode > 0 else "it is damaged: its reader crashes"
        kind = "MATLAB" if matlab else "HDF5"
        raise KembaError(str(path), f"is no {kind} file that can be read: {reason}", expected)
    with written.open("rb") as stream:
        index = json.loads(str(np.load(stream, allow_pickle=False)))
        return index, {f"a{i}": np.load(stream, allow_pickle=False) for i in range(index["count"])}


def _own(headers: list[str], content: dict[str, Any], path: Path) -> Raw:
    found = {}
    for header in headers:
        name = plain_name(header.split(" [")[0])
        if name not in content:
            raise KembaError(str(path), f"has no array '{name}', which its headers name")
        found[header] = np.atleast_1d(content[name])
    return found
