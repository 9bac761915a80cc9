"""A column map whose units do not fit is refused where it is read, before any log."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kemba.errors import ConfigErrors
from kemba.identify.logs.reading import read_log
from kemba.logs.columns import ColumnMap, ColumnSource, check_map
from kemba.logs.foreign import mapped
from kemba.logs.recording import Recording

TIME = ColumnSource(source="t")


def checked(**force: Any) -> None:
    columns = {"time [s]": TIME, "piston/F [N]": ColumnSource(source="F", **force)}
    check_map(ColumnMap(columns=columns), "map.yaml")


def test_units_must_be_of_the_quantity_that_they_give() -> None:
    checked(unit="kN", add={"source": "G", "unit": "mN"})
    for wrong in ({"unit": "kg"}, {"add": {"source": "G", "unit": "bar"}}, {"unit": "furlongs"}):
        with pytest.raises(ConfigErrors, match=r"map\.yaml: columns: 'piston/F"):
            checked(**wrong)


def test_an_offset_without_unit_is_refused_where_it_could_be_in_either() -> None:
    checked(unit="kN", offset="2 N")
    checked(unit="N", offset=2.0)
    with pytest.raises(ConfigErrors, match=r"offset 2 needs a unit: '2 kN' or '2 N'"):
        checked(unit="kN", offset=2.0)


def test_times_of_half_the_digits_are_counted_with_all() -> None:
    """A difference of two times in single precision need not be one of them."""
    time = np.array([0.1, 0.3, 4000.7], np.float32)
    columns = {"time [s]": TIME, "piston/F [N]": ColumnSource(source="F")}
    raw = Recording({"t": time, "F": np.arange(3.0)})
    found = mapped(raw, ColumnMap(origin="first", columns=columns), Path("log.npz"))
    assert found.time.tolist() == (time.astype(float) - float(time[0])).tolist()
    assert found.time[-1] != float(time[-1] - time[0])


def test_bytes_that_are_no_reading_are_read_without_a_warning(tmp_path: Path) -> None:
    """A NaN that signals, and a number whose conversion overflows, are missing readings."""
    force = np.linspace(0.0, 1e-3, 2000)
    force[1] = 1.7e308
    force.view(np.uint64)[2] = 0x7FF0_0000_0000_0001
    time = np.arange(2000) * 1e-3
    np.savez(tmp_path / "log.npz", t=time, F=force)
    columns = {"time [s]": TIME, "piston/F [N]": ColumnSource(source="F", unit="kN")}
    found = read_log(tmp_path / "log.npz", ColumnMap(kind="bench", columns=columns))
    assert np.flatnonzero(np.isnan(found["piston/F"])).tolist() == [1, 2]
    assert found["piston/F"][-1] == pytest.approx(1.0)
