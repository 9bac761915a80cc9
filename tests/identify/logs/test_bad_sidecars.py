"""Sidecars, units and single readings that cannot be: told with their place, never a traceback."""

from pathlib import Path

import numpy as np
import pytest

from kemba.errors import KembaError
from kemba.identify.logs.gate import BadData, check_logs
from kemba.identify.logs.reading import read_log
from kemba.identify.workflow import compare_logs
from kemba.trajectory import Trajectory


def beside(log_file: Path, text: str) -> Path:
    """The log with a sidecar of this text."""
    log_file.with_suffix(".meta.yaml").write_text(text)
    return log_file


@pytest.mark.parametrize("value", ["0", "-1", "null", "[1, 2]", ".nan", ".inf", "'3 kg'", "true"])
def test_a_noise_that_cannot_be_is_told_with_its_place(log_file: Path, value: str) -> None:
    with pytest.raises(KembaError, match=r"log\.meta\.yaml: noise: piston/x"):
        read_log(beside(log_file, f"noise:\n  piston/x [m]: {value}\n"))


@pytest.mark.parametrize("text", ["noise: 3", "noise: [1]"])
def test_noise_is_told_by_channel(log_file: Path, text: str) -> None:
    with pytest.raises(KembaError, match="names no channel"):
        read_log(beside(log_file, text))


@pytest.mark.parametrize("line", ["piston/x: 3e-4", "piston/x [m]: '0.3 mm'", "piston/x [mm]: 0.3"])
def test_noise_may_be_given_in_any_unit_of_its_dimension(log_file: Path, line: str) -> None:
    log = read_log(beside(log_file, f"noise:\n  {line}\n  other/thing: 3\n"))
    assert log.meta["noise"] == {"piston/x": pytest.approx(3e-4)}


def test_noise_may_have_a_correlation_time(log_file: Path) -> None:
    line = "piston/x: {sigma: 0.3 mm, time: 10 ms}"
    log = read_log(beside(log_file, f"noise:\n  {line}\n  piston/F: 1\n"))
    assert log.meta["noise"] == {"piston/x": pytest.approx(3e-4), "piston/F": 1.0}
    assert log.meta["noise_time"] == {"piston/x": pytest.approx(0.01)}


@pytest.mark.parametrize("group", ["{sigma: 1}", "{sigma: 1, time: 0}", "{sigma: -1, time: 1}"])
def test_a_group_of_noise_that_cannot_be_is_told(log_file: Path, group: str) -> None:
    with pytest.raises(KembaError, match=r"log\.meta\.yaml: noise: piston/x"):
        read_log(beside(log_file, f"noise:\n  piston/x [m]: {group}\n"))


@pytest.mark.parametrize("kind", ["[robot]", "3", "null", "robto"])
def test_a_kind_that_is_none_is_told(log_file: Path, kind: str) -> None:
    with pytest.raises(KembaError, match=r"log\.meta\.yaml: kind.*'kind: robot' or 'kind: bench'"):
        read_log(beside(log_file, f"kind: {kind}\n"))


def test_a_column_in_another_unit_is_not_read_as_ours(log_file: Path) -> None:
    log_file.write_text(log_file.read_text().replace("piston/x [m]", "piston/x [kg]"))
    with pytest.raises(BadData, match=r"\[kg\].*'piston/x \[m\]' was expected"):
        check_logs([read_log(log_file)])


def rewritten(log_file: Path, name: str, row: int, value: float) -> Path:
    """The log with one value changed."""
    log = Trajectory.read(log_file)
    values = log[name].copy()
    values[row] = value
    log.with_columns({f"{name} [{log.unit(name)}]": values}).write(log_file)
    return log_file


@pytest.mark.parametrize("value", [1e308, -1e30])
@pytest.mark.parametrize("name", ["piston/F", "piston/x"])
def test_one_absurd_reading_is_a_missing_one(log_file: Path, name: str, value: float) -> None:
    compared = compare_logs([rewritten(log_file, name, 700, value)], "planning")
    assert np.isnan(read_log(log_file)[name][700])
    assert compared


def test_the_few_readings_that_a_channel_cannot_have_are_missing_ones(log_file: Path) -> None:
    assert np.isnan(read_log(rewritten(log_file, "piston/F", 700, 1e5))["piston/F"][700])
    table = Trajectory.read(log_file)
    table.with_columns({"piston/F [N]": 100.0 * table["piston/F"]}).write(log_file)
    with pytest.raises(BadData, match="cannot be"):  # many are a mistake of units, and are told
        check_logs([read_log(log_file)])


def test_a_scaled_voltage_may_be_a_little_off(log_file: Path) -> None:
    assert check_logs([read_log(rewritten(log_file, "valve/extend", 3, 1.0000008))]) == []
    assert check_logs([read_log(rewritten(log_file, "valve/extend", 3, -0.01))]) == []
    with pytest.raises(BadData, match=r"the valve command is 1\.1"):
        check_logs([read_log(rewritten(log_file, "valve/extend", 3, 1.1))])
