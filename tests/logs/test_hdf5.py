"""Files of HDF5 that are not MATLAB's."""

from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from foreign_files import robot_log

from kemba.errors import KembaError
from kemba.identify.logs.reading import needed, read_log
from kemba.logs import load_map
from kemba.logs.draft.draft import draft_map
from kemba.logs.formats import reader

LOG = robot_log()
COLUMNS = {"time": LOG.time, **{name.replace("/", "_"): LOG[name] for name in LOG.names}}


def vectors(file: h5py.File) -> None:
    for name, values in COLUMNS.items():
        file[name] = values


def units(file: h5py.File) -> None:
    """In attributes, of packed columns."""
    for name, values in COLUMNS.items():
        size, unit = (
            (1e3, "ms" if name == "time" else "mm")
            if name in ("time", "body_x", "body_z")
            else (1, "")
        )
        data = file.create_dataset(name, data=size * values, compression="gzip")
        data.attrs["units"] = unit


def two_rates(file: h5py.File) -> None:
    """Groups with a clock each."""
    for name, values in COLUMNS.items():
        if name != "time":
            slow = name.startswith("body")
            file[f"{'mocap' if slow else 'legs'}/{name}"] = values[::10] if slow else values
    file["mocap/timestamp"], file["legs/timestamp"] = LOG.time[::10], LOG.time


def table(file: h5py.File) -> None:
    file["log"] = np.rec.fromarrays(list(COLUMNS.values()), names=list(COLUMNS))


def matrix(file: h5py.File) -> None:
    file["data"] = np.column_stack(list(COLUMNS.values()))
    file["names"] = np.array(list(COLUMNS), dtype="S")


def labelled(file: h5py.File) -> None:
    file["run/data"] = np.column_stack(list(COLUMNS.values()))
    file["run/data"].attrs["columns"] = list(COLUMNS)


@pytest.mark.parametrize("fill", [vectors, units, two_rates, table, matrix, labelled])
@pytest.mark.parametrize("ending", [".h5", ".hdf5"])
def test_columns_are_read(fill: Callable[[h5py.File], None], ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"log{ending}"
    with h5py.File(path, "w") as file:
        file["about"] = "a jump"
        fill(file)
    draft = draft_map(path, ("front", "rear"), 0.07)
    assert not draft.missing and not draft.questions
    (tmp_path / "map.yaml").write_text(draft.text(path.name), encoding="utf-8")
    back = read_log(path, load_map(tmp_path / "map.yaml"))
    for name in needed(LOG):
        good = np.isfinite(back[name])
        assert good.sum() >= len(LOG) / 10
        expected = np.interp(back.time[good], LOG.time, LOG[name])
        np.testing.assert_allclose(back[name][good], expected, atol=1e-9)


@pytest.mark.parametrize("ending", [".h5", ".tdms"])
def test_a_unit_behind_the_name_of_a_clock_counts(ending: str, tmp_path: Path) -> None:
    """At 50 kHz, where its steps would be usual ones of another unit."""
    nptdms = pytest.importorskip("nptdms")
    path, columns = tmp_path / f"log{ending}", {"Time [ms]": 0.02 * np.arange(400.0), **COLUMNS}
    del columns["time"]
    if ending == ".h5":
        with h5py.File(path, "w") as file:
            file.update({f"run/{name}": values for name, values in columns.items()})
    else:
        with nptdms.TdmsWriter(path) as writer:
            writer.write_segment([nptdms.ChannelObject("run", n, v) for n, v in columns.items()])
    assert draft_map(path, ("front", "rear"), 0.07).columns["time [s]"]["unit"] == "ms"


def test_what_has_no_clock_is_left_out_and_said(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "log.h5", "w") as file:
        two_rates(file)
        file["calibration/gains"] = [1.0, 2.0, 3.0]
    said = reader(tmp_path / "log.h5")(tmp_path / "log.h5").remarks
    assert said == ("left out, since they have no times: calibration/gains",)


@pytest.mark.parametrize(
    ("content", "what"),
    [(b"\x89HDF\r\n\x1a\nxxxx", "is no HDF5 file that can be read"), (b"", "is no HDF5 file")],
)
def test_a_damaged_file_is_told(content: bytes, what: str, tmp_path: Path) -> None:
    (tmp_path / "log.h5").write_bytes(content)
    with pytest.raises(KembaError, match=what):
        draft_map(tmp_path / "log.h5", ("front", "rear"), 0.07)


def test_a_file_without_columns_says_what_it_holds(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["note"] = "hello"
    with pytest.raises(KembaError, match="holds no vector of numbers: 'note'"):
        draft_map(tmp_path / "log.h5", ("front", "rear"), 0.07)
