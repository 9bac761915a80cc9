"""Formats of data loggers, simulators and middleware, written by their own libraries."""

from pathlib import Path

import numpy as np
import pytest
from foreign_files import logs_out, robot_log
from loggers import LEGS, START, bag, columns_of, lvm, mcap_of_ros2, mdf, opensim, tdms, ulog
from mcap.writer import Writer
from scipy.io import savemat

from kemba.errors import KembaError
from kemba.identify.logs.reading import read_log
from kemba.logs import ColumnMap, ColumnSource, load_map, open_log
from kemba.logs.draft.draft import draft_map
from kemba.logs.foreign import mapped, raw_columns
from kemba.logs.formats.mcap import Topic
from kemba.logs.recording import Group, Recording, recording, shared
from kemba.trajectory import Trajectory


def read_back(path: Path, tmp_path: Path) -> Trajectory:
    """The log through its drafted map."""
    draft = draft_map(path, LEGS, 0.07)
    assert not draft.missing and not draft.questions, draft
    target = tmp_path / "map.yaml"
    target.write_text(draft.text(path.name), encoding="utf-8")
    return read_log(path, load_map(target))


def same(back: Trajectory, log: Trajectory, atol: float = 1e-9) -> None:
    time = back.time - back.time[0]
    assert time[-1] == pytest.approx(log.time[-1], abs=2e-3)
    for name in log.names:
        good = np.isfinite(back[name])
        assert good.any(), name
        expected = np.interp(time[good], log.time, log[name])
        slack = 1.0 if "valve" in name else atol
        assert np.quantile(np.abs(back[name][good] - expected), 0.98) <= slack, name


@pytest.mark.parametrize("piece", [20_000, 40, 33])
def test_mdf(piece: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two groups at their own rates, units as the file states them, in however many pieces."""
    monkeypatch.setattr("kemba.logs.formats.measured.PIECE", piece)
    log = robot_log()
    units = raw_columns(mdf(log, tmp_path / "log.mf4"), None).units
    assert units["front_hip_q"] == "deg" and units["rear_hip_tau"] == "Nm"
    assert "front_piston_x" not in units
    back = read_back(tmp_path / "log.mf4", tmp_path)
    same(back, log, 1e-6)
    assert np.isfinite(back["body/z"]).sum() == 40 and len(back) == 400
    assert "have a clock of their own" in back.meta["read"][0]


def test_readings_that_mdf_calls_invalid_are_missing(tmp_path: Path) -> None:
    """And a valve whose states have names is 0 or 1."""
    asammdf = pytest.importorskip("asammdf")
    log, bad = robot_log(), np.arange(400) // 50 == 2
    named = {"val_0": 0, "text_0": b"off", "val_1": 1, "text_1": b"on", "default": b"?"}
    signals = []
    for name, values in columns_of(log).items():
        wrong, valve = name == "body_z", "valve" in name
        shown = np.where(bad, 9.99, values) if wrong else values.astype(np.uint8 if valve else "f8")
        more = {"invalidation_bits": bad} if wrong else {"conversion": named} if valve else {}
        signals.append(asammdf.Signal(shown, log.time, name=name, **more))
    with asammdf.MDF(version="4.10") as file:
        file.append(signals)
        file.save(tmp_path / "log.mf4")
    back = read_back(tmp_path / "log.mf4", tmp_path)
    same(back, log, 1e-9)
    assert np.array_equal(np.isnan(back["body/z"]), bad)


@pytest.mark.parametrize("clock", ["", "Time", "Zeit [s]"])
def test_tdms(clock: str, tmp_path: Path) -> None:
    """Waveforms with increments and offsets of their own; else a channel of times, and what is not
    as long is named."""
    log = robot_log()
    back = read_back(tdms(log, tmp_path / "log.tdms", clock), tmp_path)
    same(back, log, 2e-4)
    assert not clock or "not as long as" in back.meta["read"][0]


def test_ulog(tmp_path: Path) -> None:
    """Messages at their own rates."""
    pytest.importorskip("pyulog")
    log = robot_log()
    same(read_back(ulog(log, tmp_path / "log.ulg"), tmp_path), log, 1e-6)


def test_lvm(tmp_path: Path) -> None:
    """LabVIEW with decimal commas and a comment behind the numbers."""
    log = robot_log()
    same(read_back(lvm(log, tmp_path / "log.lvm"), tmp_path), log, 1e-6)


@pytest.mark.parametrize("ending", ["sto", "mot"])
def test_opensim(ending: str, tmp_path: Path) -> None:
    """y is up, z to the side, angles, and these alone, in degrees by the header."""
    draft = draft_map(opensim(tmp_path / f"log.{ending}"), LEGS)
    assert draft.columns["body/z [m]"]["source"] == "pelvis_ty"
    assert draft.columns["body/pitch [rad]"] == {"source": "pelvis_tilt", "unit": "deg"}
    assert draft.columns["front/hip/q [rad]"] == {"source": "hip_front_q", "unit": "deg"}
    assert draft.columns["front/piston/x [m]"] == {"source": "piston_front_length_x"}
    assert draft.columns["front/hip/tau [N.m]"] == {"source": "hip_front_torque"}
    assert draft.columns["front/piston/F [N]"] == {"source": "piston_front_force"}


def check_joints(path: Path, tmp_path: Path) -> None:
    """Joints by name, and what a JointState does not hold is missing."""
    log, draft = robot_log(), draft_map(path, LEGS)
    assert "body/z [m]" in draft.missing and "front/hip/q [rad]" not in draft.missing
    (tmp_path / "map.yaml").write_text(draft.text(path.name))
    back = read_log(path, load_map(tmp_path / "map.yaml"))
    for leg in LEGS:
        for column in ("hip/q", "hip/tau"):
            assert np.allclose(back[f"{leg}/{column}"], log[f"{leg}/{column}"]), column
    assert np.allclose(back.time, log.time, atol=1e-9)


@pytest.mark.parametrize("cut", [False, True])
def test_mcap_of_ros2(cut: bool, tmp_path: Path) -> None:
    """What rosbag2 records by default; of a file that was cut off, its whole chunks."""
    path = mcap_of_ros2(tmp_path / "log.mcap")
    if not cut:
        check_joints(path, tmp_path)
        return
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    found = raw_columns(path, None)
    assert 50 < (count := len(found.columns["time"])) < 400
    assert f"breaks off after {count} messages" in found.remarks[0]


@pytest.mark.parametrize("folder", [False, True])
@pytest.mark.parametrize("defined", [False, True])
def test_bags_of_ros2(folder: bool, defined: bool, tmp_path: Path) -> None:
    """SQLite files with and without definitions of their messages, alone or in their folder."""
    place = tmp_path / "bag"
    place.mkdir()
    bag(place / "bag_0.db3", defined)
    (place / "metadata.yaml").write_text("rosbag2_bagfile_information: {version: 5}\n")
    check_joints(place if folder else place / "bag_0.db3", tmp_path)


def test_mcap_of_protobuf(tmp_path: Path) -> None:
    pytest.importorskip("google.protobuf")
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    file = descriptor_pb2.FileDescriptorProto(name="leg.proto", package="log", syntax="proto3")
    kind = file.message_type.add(name="Leg")
    for number, field in enumerate(("position", "force"), start=1):
        kind.field.add(name=field, number=number, type=1, label=1)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    made = message_factory.GetMessageClass(pool.FindMessageTypeByName("log.Leg"))
    both = descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString()
    path = tmp_path / "log.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel(
            "/leg", "protobuf", writer.register_schema("log.Leg", "protobuf", both)
        )
        other = writer.register_channel("/camera", "h264", 0)
        for i in range(20):
            stamp = START + i * 10**6
            data = made(position=0.001 * i, force=2.0 * i).SerializeToString()
            writer.add_message(channel, stamp, data, stamp)
            writer.add_message(other, stamp, b"...", stamp)
        writer.finish()
    columns = {
        "time [s]": ColumnSource(source="time", unit="ns"),
        "piston/x [m]": ColumnSource(source="/leg/position"),
        "piston/F [N]": ColumnSource(source="/leg/force"),
    }
    log = open_log(path, ColumnMap(origin="first", columns=columns))
    assert log["piston/x"] == pytest.approx(0.001 * np.arange(20))
    assert "/camera is not read: its messages are h264" in log.meta["read"][0]


@pytest.mark.parametrize("version", ["v7", "v7.3"])
def test_logs_out_of_simulink(version: str, tmp_path: Path) -> None:
    """A Dataset of signals whose values are structs of timeseries, as Simulink logs buses; the
    shipped map gives the robot's columns at once. Written by mat-io in imitation of MATLAB."""
    pytest.importorskip("matio")
    log = robot_log(200)
    path = logs_out(log, tmp_path / "logsOut.mat", version)
    back = open_log(path, load_map("logsout"))
    assert back.time == pytest.approx(log.time)
    for name in back.names:
        if name in log:
            assert np.allclose(back[name], log[name]), name
    assert "front/valve/extend" in back and "front/hip/tau" not in back
    notes = [note for note in draft_map(path, LEGS).notes if "shipped" in note]
    assert notes == ["the shipped map 'logsout' fits these columns: --map logsout"]


def test_a_simulink_structure_with_time(tmp_path: Path) -> None:
    log = robot_log(200)
    columns = columns_of(log)
    signals = np.array(
        [(v[:, None], name) for name, v in columns.items()],
        dtype=[("values", object), ("label", object)],
    )
    content = {"simout": {"time": log.time, "signals": signals, "blockName": "m"}}
    savemat(tmp_path / "log.mat", content)
    same(read_back(tmp_path / "log.mat", tmp_path), log)


def test_vectors_of_two_rates(tmp_path: Path) -> None:
    log = robot_log()
    content = {"t": log.time, "t_body": log.time[::10]}
    for name, values in columns_of(log).items():
        content[name] = values[::10] if name.startswith("body") else values
    content["lost"] = np.arange(7.0)
    savemat(tmp_path / "log.mat", content)
    back = read_back(tmp_path / "log.mat", tmp_path)
    same(back, log)
    assert np.isfinite(back["body/z"]).sum() == 40
    assert "left out, since no vector of their length is a time: lost" in back.meta["read"][0]


def test_structs_in_a_struct_share_its_time(tmp_path: Path) -> None:
    log = robot_log()
    parts: dict[str, dict[str, np.ndarray]] = {}
    for name in log.names:
        part, _, rest = name.partition("/")
        parts.setdefault(part, {})[rest.replace("/", "_")] = log[name]
    savemat(tmp_path / "log.mat", {"robot": {"time": log.time, **parts}})
    same(read_back(tmp_path / "log.mat", tmp_path), log)


def test_what_holds_no_series_is_named_with_the_way_out(tmp_path: Path) -> None:
    savemat(tmp_path / "log.mat", {"gain": 3.0, "name": "EMPS"})
    with pytest.raises(KembaError, match="holds no vector of numbers: 'gain'"):
        draft_map(tmp_path / "log.mat", LEGS)


def test_messages_of_several_shapes_are_one_topic() -> None:
    """Fields that come later, lists that grow, a number that becomes a list, texts between."""
    topic = Topic("/log")
    messages = [
        {"a": 1.0, "state": "idle"},
        {"a": 2, "b": [3.0]},
        {"a": 3.0, "b": [4.0, 5.0], "state": "on"},
        {"a": 4.0, "b": 6.0},
        {"name": ["hip", "knee"], "position": [7.0, 8.0]},
        {"name": ["knee", "hip"], "position": np.array([9.0, 10.0])},
    ]
    for stamp, message in enumerate(messages):
        topic.add(stamp, message)
    nan = np.nan
    expected = {
        "a": [1, 2, 3, 4, nan, nan], "b/0": [nan, 3, 4, nan, nan, nan],
        "b/1": [nan, nan, 5, nan, nan, nan], "b": [nan, nan, nan, 6, nan, nan],
        "position/hip": [nan] * 4 + [7, 10], "position/knee": [nan] * 4 + [8, 9],
    }  # fmt: skip
    columns = topic.group([]).columns
    assert columns.keys() == expected.keys() and "state" in topic.texts
    for name, values in expected.items():
        np.testing.assert_array_equal(columns[name], values)


def test_messages_of_one_stamp_count_once() -> None:
    """The first of them, in the order of the stamps, whatever the order in which they came."""
    for order in ((0, 1, 2, 3), (3, 1, 0, 2)):
        topic, sent = Topic("/log"), ((3, 1.0), (5, 2.0), (5, 9.0), (8, 4.0))
        for i in order:
            topic.add(sent[i][0], {"x": sent[i][1]})
        said: list[str] = []
        group = topic.group(said)
        assert group.time.tolist() == [3, 5, 8] and group.columns["x"].tolist() == [1, 2, 4]
        assert said == ["1 of 4 messages of /log have the stamp of another one and are left out"]


@pytest.mark.parametrize("late", [40_000_000, 3_000_000_000])
def test_messages_that_say_when_they_were_sent(late: int) -> None:
    """A recorder writes them late and in bursts; a header of another clock tells nothing."""
    topic, sent = Topic("/mocap"), START + 10**6 * np.arange(40)
    written = sent[np.arange(40) // 10 * 10] + late
    for at, stamp in zip(written.tolist(), sent.tolist(), strict=True):
        header = {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}}
        topic.add(at, {"header": header, "x": 1.0})
    said: list[str] = []
    group = topic.group(said)
    if late < 10**9:
        assert np.array_equal(group.time, sent)
        assert said == [
            "the times of /mocap are those of its headers, 35.5 ms before they were written"
        ]
    else:
        assert np.array_equal(group.time, np.unique(written)) and "36 of 40 messages" in said[0]


@pytest.mark.parametrize(
    ("name", "head"),
    [
        ("log.lvm", ["LabVIEW Measurement", "***End_of_Header***", "", "***End_of_Header***"]),
        ("log.sto", ["log", "version=1", "", "endheader"]),
    ],
)
def test_a_cell_that_is_no_number_is_told_at_its_place(
    name: str, head: list[str], tmp_path: Path
) -> None:
    rows = ["X_Value\tx", "0\t1", "0.1\toops"]
    (tmp_path / name).write_text("\n".join([*head, *rows]) + "\n")
    with pytest.raises(KembaError, match=rf"{name}:7:2: 'oops' is not a number"):
        raw_columns(tmp_path / name, None)


def test_readings_just_outside_the_log_count_at_their_own_times(tmp_path: Path) -> None:
    """Stamps in ms; the slow clock begins before the fast one and ends after it."""
    t, slow = np.arange(10.0), np.array([-0.5, 3.0, 6.0, 9.5])
    savemat(tmp_path / "log.mat", {"t": t, "x": t, "t_slow": slow, "load": slow})
    columns = {
        "time [s]": ColumnSource(source="t", unit="ms"),
        "piston/x [m]": ColumnSource(source="x"),
        "piston/F [N]": ColumnSource(source="load"),
    }
    log = open_log(tmp_path / "log.mat", ColumnMap(kind="bench", columns=columns))
    assert log["piston/F"][[0, 3, 6, 9]] == pytest.approx([0.0, 3.0, 6.0, 9.0])


def test_stamps_of_this_century_keep_their_nanoseconds() -> None:
    """A float of so many nanoseconds is 256 of them off: 0.26 of this channel."""
    fast = START + np.arange(10) * 10**6
    slow = START + np.array([300, 3_000_100, 6_000_200, 9_000_077])
    raw = Recording(
        {"t": fast, "x": np.zeros(10), "u": slow, "load": 1e-3 * (slow - START)},
        clocks={"x": "t", "load": "u"},
    )
    columns = {
        "time [s]": ColumnSource(source="t", unit="ns"),
        "piston/x [m]": ColumnSource(source="x"),
        "piston/F [N]": ColumnSource(source="load"),
    }
    log = mapped(raw, ColumnMap(origin="first", columns=columns), Path("log.mcap"))
    assert log["piston/F"][[3, 6, 9]] == pytest.approx([3000.0, 6000.0, 9000.0], abs=1e-3)


def test_a_series_of_a_start_and_an_increment(tmp_path: Path) -> None:
    """As MATLAB keeps a timeseries of even steps: without the times themselves."""
    x = np.arange(20.0) ** 2
    info = {"Start": 0.5, "Increment": 0.01}
    series = {name: {"Data": k * x, "TimeInfo": info} for name, k in (("x", 1), ("load", 2))}
    savemat(tmp_path / "log.mat", series)
    found = raw_columns(tmp_path / "log.mat", None).columns
    assert found["time"] == pytest.approx(0.5 + 0.01 * np.arange(20))
    assert found["x"].tolist() == x.tolist() and found["load"].tolist() == (2 * x).tolist()


def test_every_clock_has_a_name_of_its_own(tmp_path: Path) -> None:
    """Three waveforms of one length and three starts; names that come again are numbered."""
    nptdms = pytest.importorskip("nptdms")
    path, channels = tmp_path / "log.tdms", []
    for name, start in (("a", 0.0), ("b", 0.003), ("c", 0.007)):
        given = {"wf_increment": 1e-3, "wf_start_offset": start, "unit_string": f"unit {name}"}
        values = start + 1e-3 * np.arange(50)
        channels.append(nptdms.ChannelObject("log", name, values, properties=given))
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(channels)
    raw = raw_columns(path, None)
    assert {name: raw.columns[raw.clocks[name]][0] for name in "abc"} == pytest.approx(
        {"a": 0.0, "b": 0.003, "c": 0.007}
    )
    t, later = np.arange(3.0), 1.0 + np.arange(3.0)
    legs = [Group("", clock, "s", {"q": clock}, {"q": "rad"}) for clock in (t, later)]
    found = recording(legs)
    assert found.columns["q"].tolist() == t.tolist() == found.columns["time"].tolist()
    assert found.columns["q#2"].tolist() == later.tolist() and found.units["q#2"] == "rad"
    assert found.columns[found.clocks["q#2"]].tolist() == later.tolist()
    together = shared([Group("", t, "s", {"q": k * t}, {"q": f"u{k}"}) for k in (1, 2)])
    assert together[0].columns["q#2"].tolist() == [0, 2, 4]
    assert together[0].units == {"q": "u1", "q#2": "u2"}


def test_a_recording_that_breaks_off_is_read_and_told(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Each channel as far as it goes, without the words of the package that reads it."""
    whole = tdms(robot_log(), tmp_path / "log.tdms").read_bytes()
    (tmp_path / "log.tdms").write_bytes(whole[: len(whole) // 2])
    raw = raw_columns(tmp_path / "log.tdms", None)
    assert raw.remarks[0] == "it breaks off: its channels end at different times"
    lengths = {len(raw.columns[name]) for name in raw.clocks}
    assert len(lengths) == 3 and all(
        len(raw.columns[name]) == len(raw.columns[clock]) for name, clock in raw.clocks.items()
    )
    (tmp_path / "log.sto").write_text("log\nendheader\ntime\tx\n")  # NumPy warns of no rows
    assert len(raw_columns(tmp_path / "log.sto", None).columns["x"]) == 0
    assert capfd.readouterr() == ("", "")
