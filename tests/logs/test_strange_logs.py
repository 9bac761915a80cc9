"""Logs in the ways of other programs are read right, or a person is asked; none is read wrong."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from foreign_files import robot_log
from strange_logs import judged, way, written

from kemba.errors import KembaError
from kemba.identify.logs.reading import read_log
from kemba.logs import ColumnMap, load_map
from kemba.logs.draft.draft import draft_map
from kemba.logs.formats import reader
from kemba.logs.times import seconds
from kemba.trajectory import Trajectory


@pytest.mark.parametrize("first", range(0, 40, 10))
def test_no_log_is_read_wrong(first: int, tmp_path: Path) -> None:
    """Ten at a time; benchmarks/foreign_logs.py takes any number of them."""
    read = 0
    for seed in range(first, first + 10):
        path, log = written(way(seed), tmp_path)
        verdict = judged(path, log)
        assert verdict.what not in ("wrong", "crash"), (way(seed), verdict.why)
        read += verdict.what == "read"
    assert read >= 8


@pytest.mark.nightly
def test_no_log_of_hundreds_is_read_wrong(tmp_path: Path) -> None:
    verdicts = [judged(*written(way(seed), tmp_path)).what for seed in range(1000, 1400)]
    assert not {"wrong", "crash"} & set(verdicts)
    assert verdicts.count("read") >= 0.8 * len(verdicts)


def test_blanks_in_dates_and_names_separate_nothing(tmp_path: Path) -> None:
    """Here they happen to give as many names as cells."""
    log = robot_log()
    table = {n.replace("/", "_"): log[n] for n in log.names}
    table |= {"imu_acc_x [m/s^2]": log.time, "imu_acc_z [m/s^2]": log.time}
    seconds = pd.Timestamp("2025-12-19 12:30:54") + pd.to_timedelta(log.time, "s")
    table["Date"] = seconds.strftime("%b %d, %Y %H:%M:%S.%f").to_numpy()
    pd.DataFrame(table).to_csv(tmp_path / "log.tsv", index=False, sep="\t")
    draft = draft_map(tmp_path / "log.tsv", ("front", "rear"), 0.07)
    assert not draft.missing and not draft.questions
    assert draft.columns["rear/piston/x [m]"]["source"] == "rear_piston_x"


@pytest.mark.parametrize(
    ("extra", "up"),
    [
        (("imu_acc_x [m/s^2]", "imu_acc_z [m/s^2]"), True),
        (("front_foot_Fz [N]",), True),
        (("acc_x", "acc_y", "acc_z"), False),
        (("vy", "vz"), False),
    ],
)
def test_a_z_of_another_kind_does_not_make_y_lateral(
    extra: tuple[str, ...], up: bool, tmp_path: Path
) -> None:
    """Unless it stands beside a y of that kind: then y may be lateral, and a person is asked."""
    log = robot_log()
    table = {"t [s]": log.time, **{n.replace("/", "_"): log[n] for n in log.names}}
    table |= {"x [m]": table.pop("body_x"), "y [m]": table.pop("body_z")}
    table |= {name: np.sin(log.time) for name in extra}
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    columns = draft_map(tmp_path / "log.csv", ("front", "rear"), 0.07).columns
    assert (columns.get("body/z [m]", {}).get("source") == "y [m]") is up


@pytest.mark.parametrize("where", ["name", "number", "end"])
def test_a_stray_quote_is_told_at_its_line(where: str, tmp_path: Path) -> None:
    """Readers of CSV take all up to the next quote for one cell, of any length."""
    log = robot_log()
    log.write(tmp_path / "log.csv")
    lines = (tmp_path / "log.csv").read_text().split("\n")
    at = 0 if where == "name" else 17
    lines[at] = f'"{lines[at]}' if where != "end" else f'{lines[at]}"'
    (tmp_path / "log.csv").write_text("\n".join(lines))
    with pytest.raises(KembaError, match=r"log\.csv:1" if where == "name" else r"log\.csv:18"):
        read_log(tmp_path / "log.csv")


@pytest.mark.parametrize(
    ("texts", "expected"),
    [
        (["10:00:59.5", "10:01:00.25"], 0.75),
        (["23:59:59.9", "00:00:00.1"], 0.2),
        (["59:59.5", "00:00.5"], 1.0),
        (["11:59:59.5 AM", "12:00:00.5 PM"], 1.0),
        (["31.12.2026 23:59:59,5", "01.01.2027 00:00:00,5"], 1.0),
        (["2026-12-31T23:59:59.5Z", "2027-01-01T00:00:00.5Z"], 1.0),
        (["Dec 31, 2026 10:00:00.5", "Dec 31, 2026 10:00:01.5"], 1.0),
        (["-1 days +23:59:59.700000", "0 days 00:00:00.100000"], 0.4),
        (["20261231T100000.5", "20261231T100001.25"], 0.75),
        (["10:00:00:500", "10:00:01:250"], 0.75),
        (["0.1 s", "0.25 s"], 0.15),
        (["100ms", "2e2ms"], 0.1),
        (["PT0.1S", "PT1M0.2S"], 60.1),
        (["1h 59 min 59.5 s", "2 h"], 0.5),
    ],
)
def test_times_in_words(texts: list[str], expected: float) -> None:
    read = seconds(np.array(texts, dtype=object))
    assert read is not None and read[1] == pytest.approx(expected)


@pytest.mark.parametrize(
    "texts", [["a:b", "c:d"], ["10:00:00+01:00", "10:00:01+02:00"], ["1", "2"], ["1 V", "2 V"]]
)
def test_what_is_no_time_in_words(texts: list[str]) -> None:
    assert seconds(np.array(texts, dtype=object)) is None


@pytest.mark.parametrize(
    ("column", "names"),
    [
        ("front_piston_x", ("front_piston_x_k", "front_piston_x_j")),
        ("front_piston_x", ("front_piston_lvdt", "front_piston_laser")),
        ("body_z", ("body_z_mocap", "body_z_laser")),
        ("body_z", ("body_z", "body_height")),
        ("body_pitch", ("imu_pitch", "mocap_pitch")),
        ("front_hip_q", ("front_hip_enc", "front_hip_motor_angle")),
        ("front_hip_q", ("front_hip_motor_pos", "front_hip_joint_pos")),
    ],
)
def test_two_columns_that_fit_as_well_are_a_question(
    column: str, names: tuple[str, str], tmp_path: Path
) -> None:
    log = robot_log()
    table = {"t": log.time, **{n.replace("/", "_"): log[n] for n in log.names}}
    values = table.pop(column)
    table |= {names[0]: values, names[1]: values + 0.001}
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    draft = draft_map(tmp_path / "log.csv", ("front", "rear"), 0.07)
    assert not set(names) & {source["source"] for source in draft.columns.values()}
    assert not draft.missing
    assert any(f"'{names[0]}' or '{names[1]}'" in text for text in draft.questions)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("front_hip_q [counts]", "which is no unit that is known"),
        ("front_hip_q_counts", "is in 'counts', which is no unit that is known"),
        ("front_hip_q_des", "which column is measured"),
    ],
)
def test_what_names_leave_open_is_asked(name: str, words: str, tmp_path: Path) -> None:
    log = robot_log()
    table = {"t": log.time, **{n.replace("/", "_"): log[n] for n in log.names}}
    table[name] = table.pop("front_hip_q")
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    draft = draft_map(tmp_path / "log.csv", ("front", "rear"), 0.07)
    assert any(words in question for question in draft.questions), draft.questions


@pytest.mark.parametrize(
    ("name", "ticks", "every", "asked"),
    [
        ("time", 1e4, 1, True),  # 0.1 ms
        ("time", 1e7, 1, True),  # 100 ns
        ("sample", 1e3, 1, False),  # said in the draft; `check` refuses another rate
        ("", 500, 2, False),
        ("time", 1 / 60, 1, True),  # min
        ("time", 1e3, 1, False),
        ("time", 1e6, 2, False),
        ("time", 1.0, 10, False),
    ],
)
def test_ticks_that_names_do_not_tell_are_asked(
    name: str, ticks: float, every: int, asked: bool, tmp_path: Path
) -> None:
    """The step between rows tells a unit only where the rate is a usual one in it."""
    log = robot_log(800).rows(slice(None, None, every))
    time = log.time * ticks if ticks <= 1 else np.round(log.time * ticks).astype(int)
    table = {name: time, **{n.replace("/", "_"): log[n] for n in log.names}}
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    draft = draft_map(tmp_path / "log.csv", ("front", "rear"), 0.07)
    assert any("ms apart" in question for question in draft.questions) is asked


def test_wrapped_angles_are_joined_and_said(tmp_path: Path) -> None:
    t = np.arange(2000) * 1e-3
    q = 8 * t + 0.3 * np.sin(9 * t)
    turned = (q + np.pi) % (2 * np.pi) - np.pi
    log = Trajectory(t, {"axis/q [rad]": turned, "axis/tau [N.m]": np.cos(t)}, {"kind": "drive"})
    log.write(tmp_path / "log.csv")
    back = read_log(tmp_path / "log.csv")
    assert back["axis/q"] == pytest.approx(q) and "begins anew" in back.meta["read"][0]
    frame = pd.DataFrame({"t": t, "angle [deg]": np.degrees(turned), "torque [Nm]": np.cos(t)})
    frame.to_csv(tmp_path / "other.csv", index=False)
    draft = draft_map(
        tmp_path / "other.csv", (), None, "drive", {"axis/q": "rad", "axis/tau": "N.m"}
    )
    assert draft.columns["axis/q [rad]"]["unwrap"] is True
    for unwrap, angle in ((None, q), (True, q), (False, turned)):
        columns = {h: {**s, "unwrap": unwrap} for h, s in draft.columns.items()}
        read = read_log(tmp_path / "other.csv", ColumnMap(kind="drive", columns=columns))
        assert np.ptp(read["axis/q"] - angle) == pytest.approx(0.0, abs=1e-9)
        assert ("begins anew" in str(read.meta.get("read"))) is (unwrap is not False)


def test_the_pitch_of_a_quaternion(tmp_path: Path) -> None:
    log = robot_log()
    table = {"t": log.time, **{n.replace("/", "_"): log[n] for n in log.names}}
    half = 0.5 * table.pop("body_pitch")
    table |= {
        "base.q.x": 0 * half,
        "base.q.y": np.sin(half),
        "base.q.z": 0 * half,
        "base.q.w": np.cos(half),
    }
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    draft = draft_map(tmp_path / "log.csv", ("front", "rear"), 0.07)
    (tmp_path / "map.yaml").write_text(draft.text("log.csv"))
    back = read_log(tmp_path / "log.csv", load_map(tmp_path / "map.yaml"))
    assert back["body/pitch"] == pytest.approx(log["body/pitch"], abs=1e-9)


def plain_log(folder: Path, more: dict[str, object] | None = None) -> tuple[Path, pd.DataFrame]:
    log = robot_log()
    columns = {"time": log.time, **{name.replace("/", "_"): log[name] for name in log.names}}
    frame = pd.DataFrame(columns | (more or {}))
    return folder / "log.csv", frame


@pytest.mark.parametrize("unit", ["gon", "rev", "counts"])
def test_a_unit_in_a_row_of_its_own_is_applied_or_asked_about(unit: str, tmp_path: Path) -> None:
    """One that is not known is no reason to guess another one."""
    path, frame = plain_log(tmp_path)
    size = {"gon": 200 / np.pi, "rev": 0.5 / np.pi, "counts": 4096 / np.pi}[unit]
    angles = [name for name in frame if name.endswith(("_q", "pitch"))]
    frame[angles] *= size
    head, *rows = frame.to_csv(index=False).split("\n")
    units = ",".join(unit if name in angles else "" for name in frame)
    path.write_text("\n".join([head, units, *rows]))
    draft = draft_map(path, ("front", "rear"), 0.07)
    said = "; ".join(draft.questions)
    if unit == "counts":
        assert "front/hip/q [rad]: 'front_hip_q' is in 'counts', which is no unit" in said
    else:
        assert {draft.columns[f"{leg}/hip/q [rad]"]["unit"] for leg in ("front", "rear")} == {unit}


@pytest.mark.parametrize("form", ["a list", "lines"])
def test_json_of_rows_is_read(form: str, tmp_path: Path) -> None:
    """Objects within them too; what one row lacks, or is null in it, is missing."""
    rows = [{"time": 1e-3 * i, "hip": {"q": None if i == 3 else 0.1 * i}} for i in range(80)]
    rows[5]["note"] = "here"  # type: ignore[assignment]
    texts = [json.dumps(row) for row in rows]
    path = tmp_path / ("log.jsonl" if form == "lines" else "log.json")
    path.write_text("\n".join(texts) if form == "lines" else f"[{', '.join(texts)}]")
    found = reader(path)(path)
    q = found.columns["hip/q"]
    assert np.isnan(q[3]) and q[4] == pytest.approx(0.4) and len(q) == 80


@pytest.mark.parametrize("dated", [True, False])
def test_json_split_by_pandas_is_read(dated: bool, tmp_path: Path) -> None:
    path, frame = plain_log(tmp_path, {"note": "on"} if dated else {})
    path = path.with_suffix(".json")
    frame.to_json(path, orient="split", double_precision=15)
    draft = draft_map(path, ("front", "rear"), 0.07)
    assert not draft.missing and not draft.questions
    path.write_text('{"columns": ["time", "body_z"]}')
    with pytest.raises(KembaError, match=r"is no JSON of columns or rows$"):
        reader(path)(path)


@pytest.mark.parametrize("mark", ["#N/A", "n/a", "<NA>", "--", "#DIV/0!"])
def test_marks_of_missing_readings(mark: str, tmp_path: Path) -> None:
    path, frame = plain_log(tmp_path)
    frame = frame.astype(object)
    frame.loc[7, "body_z"] = mark
    frame.to_csv(path, index=False)
    target = tmp_path / "map.yaml"
    target.write_text(draft_map(path, ("front", "rear"), 0.07).text(path.name))
    assert np.flatnonzero(np.isnan(read_log(path, load_map(target))["body/z"])).tolist() == [7]


@pytest.mark.parametrize("line", ["header", "End of log", "# trigger, by hand", "\0" * 40])
@pytest.mark.parametrize("at", [200, 401])
@pytest.mark.parametrize("dated", [True, False])
def test_a_line_that_is_no_row_is_left_out_and_said(
    line: str, at: int, dated: bool, tmp_path: Path
) -> None:
    dates = pd.date_range("2026-01-05", periods=400, freq="ms").strftime("%d.%m.%Y %H:%M:%S.%f")
    path, frame = plain_log(tmp_path, {"time": dates} if dated else {})
    text = frame.to_csv(index=False).split("\n")
    text.insert(at, text[0] if line == "header" else line)
    path.write_text("\n".join(text))
    target = tmp_path / "map.yaml"
    draft = draft_map(path, ("front", "rear"), 0.07)
    target.write_text(draft.text(path.name))
    back = read_log(path, load_map(target))
    assert not draft.questions and not draft.missing
    np.testing.assert_allclose(back["body/z"], frame["body_z"])
    assert "lines that are no rows are left out" in back.meta["read"][0]
    cells = text[300].split(",")
    text[300] = ",".join([*cells[:2], "x", *cells[3:]])
    path.write_text("\n".join(text))
    with pytest.raises(KembaError, match=r"log.csv:301:3: .*'x' is not a number.*missing: \[x\]"):
        read_log(path, load_map(target))


def test_a_cell_that_is_no_time_is_told_where_it_stands(tmp_path: Path) -> None:
    dates = pd.date_range("2026-01-05", periods=400, freq="ms").strftime("%d.%m.%Y %H:%M:%S.%f")
    path, frame = plain_log(tmp_path, {"time": dates})
    frame.loc[199, "time"] = "pause"
    frame.to_csv(path, index=False)
    with pytest.raises(
        KembaError, match=r"log.csv:201: 'pause' stands in .* other cells are times"
    ):
        draft_map(path, ("front", "rear"), 0.07)
    columns = {"time [s]": {"source": "time"}, "body/z [m]": {"source": "body_z"}}
    with pytest.raises(KembaError, match=r"log.csv:201:1: time: 'pause' is no time"):
        read_log(path, ColumnMap(columns=columns))


def test_of_two_torques_the_commanded_one_is_taken(tmp_path: Path) -> None:
    noisy = robot_log()["front/hip/tau"] + 0.5
    path, frame = plain_log(tmp_path, {"front_hip_torque_measured": noisy})
    frame = frame.rename(columns={"front_hip_tau": "hip_front_torque_cmd"})
    frame.to_csv(path, index=False)
    found = draft_map(path, ("front", "rear"), 0.07).columns["front/hip/tau [N.m]"]
    assert found["source"] == "hip_front_torque_cmd"
