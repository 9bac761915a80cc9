"""A process of its own that reads a MATLAB or HDF5 file; needs NumPy, SciPy, mat-io or h5py.

SciPy's reader is compiled code that trusts the file: damaged bytes may kill the process it runs in.
Arguments: the file, and one to write: `index` (JSON: what each array is), then the arrays, each
as in an .npy file. Exit code 1 with the reason where the file cannot be read.

What is found by walking through structs, cells and objects of any class: series, which have data
and times (timeseries, signals of a Simulink structure with time, timetables), and loose arrays.
"""

import contextlib
import json
import sys
import warnings
from typing import Any

import numpy as np
from scipy.io import loadmat
from scipy.io.matlab import MatlabOpaque

MEMORY = 6_000_000_000  # bytes: an unpacked log of the size that is allowed, three times
HDF5 = b"\x89HDF\r\n\x1a\n"  # of version 7.3, behind a header or at once
SAID = 100  # letters of a warning that are passed on
DEEPEST = 12  # structs within structs
NAMED = ("columns", "names", "column_names", "labels")  # attributes that name columns
CONTAINERS = ("values", "elements", "data", "storage", "signals")  # say nothing about a signal


class Found:
    """Series and loose arrays by path."""

    def __init__(self) -> None:
        self.series: list[tuple[str, np.ndarray, np.ndarray]] = []
        self.loose: dict[str, np.ndarray] = {}
        self.classes: list[str] = []

    def walk(self, path: str, value: Any, depth: int = 0, named: bool = True) -> None:
        """Everything in a value that is a series or an array; `named`: the path is its own."""
        if depth > DEEPEST:
            return
        fields = self.fields(value)
        if fields is not None:
            self.struct(path, fields, depth, named)
        elif hasattr(value, "to_numpy") and hasattr(value, "columns"):  # a table or timetable
            self.table(path, value)
        elif isinstance(value, np.ndarray) and value.dtype == object:
            self.cells(path, value, depth)
        elif isinstance(value, np.ndarray) and value.dtype.names:
            self.cells(path, np.array([*value.ravel(), None], dtype=object)[:-1], depth)
        elif isinstance(value, list | tuple):
            self.cells(path, np.array([*value, None], dtype=object)[:-1], depth)
        else:
            array = np.asarray(value)
            if array.dtype.kind in "fiubUM":
                self.loose[path] = np.squeeze(array)
            elif array.dtype.kind == "m":
                self.loose[path] = np.squeeze(array) / np.timedelta64(1, "s")

    def fields(self, value: Any) -> dict[str, Any] | None:
        """The fields of a struct or the properties of an object; None of anything else."""
        if isinstance(value, np.ndarray) and value.size == 1 and value.dtype == object:
            return self.fields(value.ravel()[0])
        if isinstance(value, np.ndarray) and value.size == 1 and value.dtype.names:
            value = value.ravel()[0]
        if isinstance(value, np.void) and value.dtype.names:
            return {name: value[name] for name in value.dtype.names}
        if isinstance(value, dict):
            return value
        properties = getattr(value, "properties", None)
        if properties is not None and hasattr(value, "classname"):
            self.classes.append(str(value.classname))
            if isinstance(properties, dict):
                return properties
            return self.fields(properties) if isinstance(properties, np.ndarray) else {}
        return None

    def struct(self, path: str, fields: dict[str, Any], depth: int, own: bool) -> None:
        plain = {key.strip("_").lower(): value for key, value in fields.items()}
        name = "" if "elements" in plain else text(plain.get("name", ""))
        if name and not (own and path):
            path = f"{path}/{name}".strip("/")
        time = numbers(plain.get("time"))
        if time is None and "timeinfo" in plain:
            time = uniform(self.fields(plain["timeinfo"]) or {}, plain.get("data"))
        data = plain.get("data")
        if time is not None and "signals" in plain:
            self.signals(path, time, plain["signals"])
        elif time is not None and numbers(data) is not None:
            self.series.append((path, time, np.asarray(numbers(data))))
        elif time is not None:
            self.group(path, time, fields, depth)
        else:
            rest = {k: v for k, v in fields.items() if k.strip("_").lower() not in LABELS}
            for key, value in rest.items():
                if key.strip("_").lower() in CONTAINERS:
                    self.walk(path, value, depth + 1, named="elements" not in plain)
                else:
                    self.walk(f"{path}/{key}".strip("/"), value, depth + 1)

    def signals(self, path: str, time: np.ndarray, signals: Any) -> None:
        """A Simulink structure with time (n,): its signals are labelled."""
        items = np.asarray(signals).ravel() if isinstance(signals, np.ndarray) else [signals]
        for i, item in enumerate(items):
            fields = self.fields(item) or {}
            label = text(fields.get("label", "")) or f"{path}/{i + 1}".strip("/")
            values = numbers(fields.get("values"))
            if values is not None:
                self.series.append((label, time, values))

    def group(self, path: str, time: np.ndarray, fields: dict[str, Any], depth: int) -> None:
        """A struct of a time (n,) and arrays as long, in structs of its own too, unless they have
        a time; other fields are walked through."""
        for key, value in fields.items():
            values, inner = numbers(value), self.fields(value)
            if key.strip("_").lower() == "time":
                continue
            label = f"{path}/{key}".strip("/")
            if values is not None and len(time) in values.shape:
                self.series.append((label, time, values))
            elif inner is not None and depth < DEEPEST and not _has_time(inner):
                self.group(label, time, inner, depth + 1)
            else:
                self.walk(label, value, depth + 1)

    def cells(self, path: str, value: np.ndarray, depth: int) -> None:
        """A cell array (n,): of texts, or of anything, each under its name or its number."""
        items = list(value.ravel())
        if items and all(isinstance(i, str) or text(i) for i in items):
            self.loose[path] = np.array([text(i) for i in items])
            return
        for i, item in enumerate(items):
            fields = self.fields(item)
            named = fields is not None and any(k.strip("_").lower() == "name" for k in fields)
            alone = len(items) == 1 or named
            self.walk(path if alone else f"{path}/{i + 1}", item, depth + 1, named=not named)

    def table(self, path: str, frame: Any) -> None:
        columns = {str(name): frame[name].to_numpy() for name in frame.columns}
        time = np.asarray(frame.index)
        timed = time.dtype.kind in "mM"
        seconds = (time - time[0]) / np.timedelta64(1, "s") if timed and len(time) else None
        for name, values in columns.items():
            label = f"{path}/{name}".strip("/")
            if seconds is not None and values.dtype.kind in "fiub":
                self.series.append((label, seconds, values))
            elif values.dtype.kind in "fiub":
                self.loose[label] = values


LABELS = ("name", "blockpath", "classname", "propagatedname", "porttype", "portindex", "version")


def _has_time(fields: dict[str, Any]) -> bool:
    return bool({key.strip("_").lower() for key in fields} & {"time", "timeinfo"})


def numbers(value: Any) -> np.ndarray | None:
    """A value as numbers (n, ...); None where it is something else."""
    array = inner(value)
    if array.dtype.kind == "m":
        return np.squeeze(array) / np.timedelta64(1, "s")
    return np.squeeze(array) if array.dtype.kind in "fiub" and array.size > 1 else None


def text(value: Any) -> str:
    """A value as a text; empty where it is something else."""
    array = inner(value)
    return str(array.ravel()[0]) if array.dtype.kind == "U" and array.size == 1 else ""


def inner(value: Any) -> np.ndarray:
    """The array (n, ...) in a value that may be wrapped in arrays of one entry."""
    array = np.asarray(value)
    while array.dtype == object and array.size == 1:
        only = array.ravel()[0]
        if not isinstance(only, np.ndarray | str):
            break
        array = np.asarray(only)
    return array


def uniform(info: dict[str, Any], data: Any) -> np.ndarray | None:
    """Times (n,) of a series that states its start and its increment only."""
    plain = {key.strip("_").lower(): np.asarray(value).ravel() for key, value in info.items()}
    values = numbers(data)
    if values is None or "increment" not in plain or not len(plain["increment"]):
        return None
    try:
        start, step = float(plain.get("start", [0.0])[0]), float(plain["increment"][0])
    except (TypeError, ValueError, IndexError):
        return None
    return start + step * np.arange(max(values.shape)) if step > 0 else None


def content(path: str) -> dict[str, Any]:
    """The variables of a file: by SciPy, or by mat-io with objects or in version 7.3. Raises
    SystemExit without mat-io."""
    with open(path, "rb") as stream:
        head = stream.read(520)
    if HDF5 not in (head[:8], head[512:]):
        found = loadmat(path, appendmat=False, squeeze_me=True)
        if not any(isinstance(value, MatlabOpaque) for value in found.values()):
            return dict(found)
    try:
        from matio import load_from_mat
    except ImportError:
        raise SystemExit("PACKAGE") from None
    return dict(load_from_mat(path))


def tree(path: str, found: Found) -> dict[str, str]:
    """Every array in a file of HDF5 that is not MATLAB's, the fields of tables and the columns
    that an attribute names apart, by path; and their units. Raises SystemExit without h5py."""
    try:
        import h5py
    except ImportError:
        raise SystemExit("PACKAGE") from None
    units: dict[str, str] = {}

    def visit(name: str, node: Any) -> None:
        if not isinstance(node, h5py.Dataset):
            return
        texts = h5py.check_string_dtype(node.dtype) is not None
        if node.dtype.kind == "O" and not texts:
            return
        array = np.asarray(node.asstr("utf-8", "replace")[()] if texts else node[()])
        array = array.astype(str) if texts else array
        said = {key.lower(): value for key, value in node.attrs.items()}
        labels = [str(label) for key in NAMED for label in np.ravel(said.get(key, ()))]
        if array.dtype.names:
            parts = {f"{name}/{field}": array[field] for field in array.dtype.names}
        elif array.ndim == 2 and len(set(labels)) == array.shape[1]:
            parts = {f"{name}/{label}": array[:, i] for i, label in enumerate(labels)}
        else:
            parts = {name: array}
        found.loose.update({key: v for key, v in parts.items() if v.dtype.kind in "fiubU"})
        units.update({key: str(said[u]) for key in parts for u in ("unit", "units") if u in said})

    with h5py.File(path, "r") as file:
        file.visititems(visit)
    return units


def limit_memory() -> None:
    """Let packed zeros end in a MemoryError of this process, where the system can."""
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, resource.getrlimit(resource.RLIMIT_AS)[1]))


def walked(variables: dict[str, Any]) -> Found:
    """All series and loose arrays in the variables of a file."""
    found = Found()
    own = {name: value for name, value in variables.items() if not str(name).startswith("__")}
    for name, value in own.items():
        fields = found.fields(value)
        holder = fields is not None and len(own) == 1  # the one variable says nothing
        found.walk("" if holder else str(name), value, named=not holder)
    return found


def main() -> int:
    """Write the arrays of the file argv[1] to argv[2]; 1 where it cannot be read."""
    limit_memory()
    try:
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            if sys.argv[1].lower().endswith(".mat"):
                found, units = walked(content(sys.argv[1])), dict[str, str]()
            else:
                found = Found()
                units = tree(sys.argv[1], found)
    except SystemExit:
        print("PACKAGE", file=sys.stderr)
        return 1
    except Exception as error:  # of damaged bytes the readers raise anything
        print(f"{type(error).__name__}: {error}"[:200], file=sys.stderr)
        return 1
    # mat-io warns of objects that it leaves out
    warned = {str(w.message)[:SAID] for w in told if w.category.__module__.startswith("matio")}
    arrays: list[np.ndarray] = []
    times: list[int] = []
    index: dict[str, Any] = {"series": [], "loose": [], "classes": sorted(set(found.classes))}
    index |= {"warnings": sorted(warned), "units": units}
    for name, time, values in found.series:
        at = next((i for i in times if np.array_equal(arrays[i], time)), None)
        if at is None:
            at = len(arrays)
            times.append(at)
            arrays.append(time)
        arrays.append(values)
        index["series"].append([name, at, len(arrays) - 1])
    for name, array in found.loose.items():
        arrays.append(array)
        index["loose"].append([name, len(arrays) - 1])
    index["count"] = len(arrays)
    with open(sys.argv[2], "wb") as stream:
        for array in (np.array(json.dumps(index)), *arrays):
            np.save(stream, array, allow_pickle=False)
    return 0


if __name__ == "__main__":
    sys.exit(main())
