"""Foreign columns, kinds and groups of logs."""

from pathlib import Path

import numpy as np
import pytest

from kemba.errors import KembaError
from kemba.identify.logs.gate import check_logs
from kemba.identify.logs.reading import read_log, read_logs
from kemba.logs import ColumnMap, ColumnSource, load_map
from kemba.trajectory import Trajectory

FOREIGN = """\
t_ms,pos_mm,loadcell,valve_1,valve_2
0,20,5,0,5
1,21,-6,5,5
2,22,7,5,0
"""


def test_the_authors_plan_is_read_through_its_map(authors_plan: Path) -> None:
    log = read_log(authors_plan, load_map("authors"))
    assert log.meta["kind"] == "robot"
    assert check_logs([log]) == []
    assert log["body/z"].max() == pytest.approx(0.5, abs=0.002)
    # standing: both feet under their hips, the front femur forward of the rear one's mirror image
    assert log["front/hip/q"][0] == pytest.approx(-log["rear/hip/q"][0], abs=1e-3)


def test_units_signs_and_scales_are_converted(tmp_path: Path) -> None:
    path = tmp_path / "foreign.csv"
    path.write_text(FOREIGN)
    log = read_log(path, load_map("example_bench"))
    assert log.meta["kind"] == "bench"
    assert log.time == pytest.approx([0.0, 1e-3, 2e-3])
    assert log["piston/x"] == pytest.approx([0.020, 0.021, 0.022])
    assert log["piston/F"] == pytest.approx([-5.0, 6.0, -7.0])
    assert log["valve/extend"].tolist() == [0.0, 1.0, 1.0]


def test_a_lagging_column_is_brought_forward(tmp_path: Path) -> None:
    time = np.arange(50) / 1e3
    path = tmp_path / "late.csv"
    lines = [f"{t},{(t - 0.004):.6f},{float(t >= 0.014)}" for t in time]
    path.write_text("\n".join(["t,x,u", *lines]) + "\n")
    columns = {
        "time [s]": ColumnSource(source="t"),
        "piston/x [m]": ColumnSource(source="x", delay=0.004),
        "valve/extend [1]": ColumnSource(source="u", delay=0.004),
    }
    log = read_log(path, ColumnMap(kind="bench", columns=columns))
    assert log["piston/x"][:40] == pytest.approx(time[:40], abs=1e-9)
    assert time[np.argmax(log["valve/extend"])] == pytest.approx(0.010)


def test_a_missing_foreign_column_is_named(tmp_path: Path) -> None:
    path = tmp_path / "foreign.csv"
    path.write_text(FOREIGN.replace("loadcell", "load"))
    with pytest.raises(KembaError, match=r"has no column 'loadcell'.*did you mean 'load'"):
        read_log(path, load_map("example_bench"))


def test_a_map_without_time_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "map.yaml"
    path.write_text("columns:\n  piston/x [m]: {source: a}\n  piston/F [N]: {source: b}\n")
    with pytest.raises(KembaError, match="'time \\[s\\]' is not mapped"):
        load_map(path)


def test_all_wrong_units_of_a_map_are_told_at_once(tmp_path: Path) -> None:
    columns = [
        "time [s]: {source: t, unit: mss}",
        "body/z [m]: {source: z, unit: kg}",
        "body/pitch [rad]: {source: r, unit: deg, offset: -90}",
        "front/hip/q [rad]: {source: q, unit: deg, offset: -90 deg}",
        "front/valve/extend [1]: {source: v, unit: V, threshold: 12 V}",
    ]
    path = tmp_path / "map.yaml"
    path.write_text("columns:\n" + "".join(f"  {line}\n" for line in columns), encoding="utf-8")
    with pytest.raises(KembaError) as told:
        load_map(path)
    said = str(told.value).splitlines()
    assert len(said) == 3
    assert "'mss'; did you mean 'ms'?" in said[0]
    assert "unit 'kg' is a mass" in said[1]
    assert "offset -90 needs a unit: '-90 deg' or '-90 rad'" in said[2]


def test_order_of_arguments_is_no_matter(tmp_path: Path, log_file: Path) -> None:
    other = log_file.with_name("a.csv")
    other.write_text(log_file.read_text())
    one = [log.meta["name"] for log in read_logs([log_file, other])]
    two = [log.meta["name"] for log in read_logs([other, log_file, other])]
    assert one == two == ["a", "log"]


def test_robot_and_bench_do_not_mix(log_file: Path, tmp_path: Path) -> None:
    robot = tmp_path / "robot.csv"
    Trajectory(np.arange(3) / 1e3, {"body/z [m]": np.zeros(3)}).write(robot)
    with pytest.raises(KembaError, match="cannot be fitted together"):
        read_logs([log_file, robot])
