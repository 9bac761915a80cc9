"""Logs as MATLAB files, version 5 to 7.2."""

from __future__ import annotations

import io
import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.files import atomic_path, plain
from kemba.logs.formats.arrays import Found, metadata, vectors
from kemba.logs.text import Raw
from kemba.trajectory import TIME, Trajectory

LONGEST = 120.0  # s that reading one file may take
EXPECTED = "version 5 to 7.2 was expected: save(..., '-v7')"


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


def read_mat(path: Path) -> Found:
    """Our own .mat by its headers; else every vector of the length that most vectors have."""
    content = _content(path)
    if "headers" not in content:
        return vectors(content, path), {}
    headers = [str(header) for header in np.atleast_1d(content["headers"])]
    return _own(headers, content, path), metadata(content.get("meta"))


def _content(path: Path) -> dict[str, Any]:
    """Arrays of numbers and texts, read by another process: damaged files may kill it."""
    try:
        with path.open("rb"):
            pass
    except OSError as error:
        raise KembaError(str(path), error.strerror or str(error)) from None
    child = [sys.executable, str(Path(__file__).with_name("mat_child.py")), str(path.resolve())]
    try:
        done = subprocess.run(
            child, stdin=subprocess.DEVNULL, capture_output=True, timeout=LONGEST, check=False
        )
    except subprocess.TimeoutExpired:
        what = f"cannot be read within {LONGEST:g} s as a MATLAB file"
        raise KembaError(str(path), what, EXPECTED) from None
    if done.returncode:
        said = done.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        reason = said if done.returncode > 0 else "it is damaged: its reader crashes"
        raise KembaError(str(path), f"is no MATLAB file that SciPy reads: {reason}", EXPECTED)
    with np.load(io.BytesIO(done.stdout), allow_pickle=False) as found:
        return {str(name): found[f"a{i}"] for i, name in enumerate(found["names"])}


def _own(headers: list[str], content: dict[str, Any], path: Path) -> Raw:
    found = {}
    for header in headers:
        name = plain_name(header.split(" [")[0])
        if name not in content:
            raise KembaError(str(path), f"has no array '{name}', which its headers name")
        found[header] = np.atleast_1d(content[name])
    return found
