"""Logs as MATLAB files: written in version 5, read in all, with structs and Simulink's objects."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.files import atomic_path, plain
from kemba.logs.formats import missing
from kemba.logs.formats.arrays import metadata, vectors
from kemba.logs.recording import Column, Group, Raw, Recording, recording
from kemba.trajectory import TIME, Trajectory

LONGEST = 120.0  # s that reading one file may take
EXPECTED = "a MATLAB file was expected: save(..., '-v7')"
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
    index, arrays = _content(path)
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
    for name, time, values in index["series"]:
        parts = _parts(name, arrays[f"a{values}"], len(arrays[f"a{time}"]))
        groups.setdefault(time, {}).update(parts)
    found = [Group("", arrays[f"a{time}"], "s", columns) for time, columns in groups.items()]
    left = [name for name, array in loose.items() if array.dtype.kind in "fiub" and array.ndim == 1]
    said = [f"left out, since they have no times: {', '.join(left[:6])}"] if left else []
    return recording(found, said)


def _parts(name: str, values: Column, rows: int) -> Raw:
    """The columns of a signal (n,), (n, k) or (k, n)."""
    if values.ndim == 1:
        return {name: values} if len(values) == rows else {}
    flat = values.reshape(rows, -1) if values.shape[0] == rows else values.reshape(-1, rows).T
    return {f"{name}/{i}": column for i, column in enumerate(flat.T, start=1)}


def _content(path: Path) -> tuple[dict[str, Any], dict[str, Column]]:
    """What each array is, and the arrays, read by another process: damaged files may kill it."""
    try:
        with path.open("rb"):
            pass
    except OSError as error:
        raise KembaError(str(path), error.strerror or str(error)) from None
    with tempfile.TemporaryDirectory(prefix="kemba-") as folder:
        return _by_child(path, Path(folder) / "arrays.npz")


def _by_child(path: Path, written: Path) -> tuple[dict[str, Any], dict[str, Column]]:
    script = Path(__file__).with_name("mat_child.py")
    child = [sys.executable, str(script), str(path.resolve()), str(written)]
    try:
        done = subprocess.run(
            child, stdin=subprocess.DEVNULL, capture_output=True, timeout=LONGEST, check=False
        )
    except subprocess.TimeoutExpired:
        what = f"cannot be read within {LONGEST:g} s as a MATLAB file"
        raise KembaError(str(path), what, EXPECTED) from None
    if done.returncode:
        said = done.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        if said == "PACKAGE":
            raise missing(path, ImportError(name="mat-io"))
        reason = said if done.returncode > 0 else "it is damaged: its reader crashes"
        raise KembaError(str(path), f"is no MATLAB file that can be read: {reason}", EXPECTED)
    with np.load(written, allow_pickle=False) as found:
        arrays = {name: found[name] for name in found.files if name != "index"}
        return json.loads(str(found["index"])), arrays


def _own(headers: list[str], content: dict[str, Any], path: Path) -> Raw:
    found = {}
    for header in headers:
        name = plain_name(header.split(" [")[0])
        if name not in content:
            raise KembaError(str(path), f"has no array '{name}', which its headers name")
        found[header] = np.atleast_1d(content[name])
    return found
