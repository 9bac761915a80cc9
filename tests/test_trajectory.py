"""Trajectories in memory and as CSV."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kemba.errors import KembaError
from kemba.trajectory import Trajectory

HEADER = "time [s],body/z [m],valve/extend [1]\n"


def jump() -> Trajectory:
    columns = {"body/z [m]": [0.2, 0.4, 0.3], "valve/extend [1]": [0.0, 1.0, 0.0]}
    return Trajectory([0.0, 0.1, 0.2], columns, {"kind": "robot"})


def test_columns_by_name() -> None:
    trajectory = jump()
    assert trajectory.names == ("body/z", "valve/extend")
    assert trajectory.headers == ("body/z [m]", "valve/extend [1]")
    assert trajectory.unit("body/z") == "m"
    assert len(trajectory) == 3 and "body/z" in trajectory
    np.testing.assert_array_equal(trajectory["body/z"], [0.2, 0.4, 0.3])
    with pytest.raises(KembaError, match=r"no column 'body/zz'; did you mean 'body/z'\?"):
        trajectory["body/zz"]


def test_select_and_with_columns() -> None:
    trajectory = jump().with_columns({"body/z [m]": np.zeros(3), "body/x [m]": np.ones(3)})
    assert trajectory.names == ("valve/extend", "body/z", "body/x")
    assert trajectory.select(["body/x"]).headers == ("body/x [m]",)
    assert trajectory.meta == {"kind": "robot"}


def test_wrong_shapes_and_repeated_names() -> None:
    with pytest.raises(KembaError, match=r"body/z \[m\]: has the shape \(2,\); \(3,\) as the time"):
        Trajectory([0, 1, 2], {"body/z [m]": [0, 1]})
    with pytest.raises(KembaError, match="stands twice"):
        Trajectory([0], {"body/z [m]": [0], "body/z [1]": [0]})


def test_interpolation_is_linear_or_held() -> None:
    between = jump().interpolate([-1.0, 0.05, 0.1, 0.15, 9.0], hold={"valve/extend"})
    np.testing.assert_allclose(between["body/z"], [0.2, 0.3, 0.4, 0.35, 0.3])
    np.testing.assert_array_equal(between["valve/extend"], [0, 0, 1, 1, 0])


@given(
    st.lists(
        st.tuples(st.floats(allow_infinity=False), st.floats(allow_infinity=False)),
        min_size=1,
        max_size=20,
    ),
    st.floats(1e-9, 1e3),
)
def test_csv_round_trip_is_exact(
    tmp_path_factory: pytest.TempPathFactory, rows: list[tuple[float, float]], step: float
) -> None:
    path = tmp_path_factory.getbasetemp() / "round_trip.csv"
    first, second = np.array(rows).T
    written = Trajectory(step * np.arange(len(rows)), {"a [m]": first, "b/c [N.m]": second})
    written.write(path)
    read = Trajectory.read(path)
    np.testing.assert_array_equal(read.time, written.time)
    for name in written.names:
        np.testing.assert_array_equal(read[name], written[name])
        there = ~np.isnan(written[name])
        signs = np.signbit(read[name]), np.signbit(written[name])
        np.testing.assert_array_equal(signs[0][there], signs[1][there])


def test_sidecar_and_switches(tmp_path: Path) -> None:
    path = tmp_path / "jump.csv"
    jump().write(path)
    assert path.read_text() == HEADER + "0.0,0.2,0\n0.1,0.4,1\n0.2,0.3,0\n"
    assert (tmp_path / "jump.meta.yaml").read_text() == "kind: robot\n"
    assert Trajectory.read(path).meta == {"kind": "robot"}


def test_a_failed_write_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "jump.csv"
    path.write_text("old")
    with pytest.raises(KembaError, match=r"jump.csv:3:1: the time 0 s does not come after 1 s"):
        Trajectory([1.0, 0.0], {}).write(path)
    assert path.read_text() == "old" and len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize(
    "text",
    [
        HEADER + "0,1,\n1,,0\n",
        HEADER + "0, 1 ,nan\n1, ,0\n\n",
        "\ufeff" + HEADER + "0,1,\n1,nan,0",
        (HEADER + "0,1,\n1,,0\n").replace("\n", "\r\n"),
        '"time [s]","body/z [m]","valve/extend [1]"\n0,"1",\n1,,"0"\n',
    ],
)
def test_dialects_that_are_understood(tmp_path: Path, text: str) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(text.encode())
    log = Trajectory.read(path)
    np.testing.assert_array_equal(log["body/z"], [1.0, np.nan])
    np.testing.assert_array_equal(log["valve/extend"], [np.nan, 0.0])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", ": is empty; a header row starting with 'time [s]' was expected"),
        (HEADER, ": has no rows below its header"),
        (HEADER + "0,1,2\n0,1,2\n", ":3:1: the time 0 s does not come after 0 s; times must"),
        (HEADER + ",1,2\n", ":2:1: the time is missing; times must increase"),
        (HEADER + "0,1,2\n1,2\n", ":3: 2 cells below 3 headers"),
        (HEADER + "0,1,2,3\n", ":2: 4 cells below 3 headers"),
        (HEADER + "0,1,2\n1,fast,2\n", ":3:2: body/z [m]: 'fast' is not a number"),
        (HEADER + "0,1_0,2\n", ":2:2: body/z [m]: '1_0' is not a number"),
        (HEADER + "0,1e999,2\n", ":2:2: the number is infinite"),
        (HEADER.replace(",", ";"), ":1: is separated by semicolons; commas, and decimal points"),
        (
            "t,z\n",
            ":1:1: column header 't' is malformed; 'path/symbol [unit]' was expected; for a log",
        ),
        (
            "time [s],note\n",
            ":1:2: column header 'note' is malformed; 'path/symbol [unit]' was expected; take the",
        ),
        ("time [s],z [m/s]\n", ":1:2: column header 'z [m/s]' has the malformed unit 'm/s'"),
        ("time [s],z [mm]\n", ":1:2: 'z [mm]' is not in SI units; SI inside the file was expected"),
        ("time [s],z [m],z [m]\n", ":1:3: column 'z' stands twice; it is column 2 already"),
        (
            "z [m]\n1\n",
            ":1:1: the first column is 'z [m]'; 'time [s]' was expected; for a log",
        ),
    ],
)
def test_faulty_files_are_explained(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "log.csv"
    path.write_text(text)
    with pytest.raises(KembaError) as caught:
        Trajectory.read(path)
    assert str(caught.value).startswith(f"{path}{message}")


def test_unreadable_files(tmp_path: Path) -> None:
    with pytest.raises(KembaError, match="No such file"):
        Trajectory.read(tmp_path / "none.csv")
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(KembaError, match="is not a UTF-8 text"):
        Trajectory.read(tmp_path / "binary.csv")


def test_lenient_reading_leaves_the_times_to_others(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(HEADER + "0,1,2\n0,1,2\n")
    assert len(Trajectory.read(path, strict=False)) == 2
