"""Binary formats of logs give back every bit; damaged files are told in words."""

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from foreign_files import robot_log
from mcap.reader import make_reader
from mcap.writer import Writer
from scipy.io import savemat
from typer.testing import CliRunner

from kemba.errors import KembaError
from kemba.identify.logs.reading import read_log
from kemba.logs import ColumnMap, ColumnSource, log_files, open_log
from kemba.logs.formats import arrays
from kemba.plotting.source import load_source
from kemba.report.export import export
from kemba.trajectory import Trajectory
from kemba_cli.main import app

ENDINGS = ("parquet", "mcap", "mat", "npz", "json")


def awkward() -> Trajectory:
    """Times before zero, missing readings, numbers at the ends of what a float can hold."""
    log = robot_log(50)
    z = log["body/z"].copy()
    z[3], z[4], z[5] = np.nan, 5e-324, -1.7976931348623157e308
    time = log.time / 3 - 0.1
    columns = {h: log[n] for h, n in zip(log.headers, log.names, strict=True)}
    meta = {"kind": "robot", "repeat_of": "jump_a", "noise": {"body/z [m]": 3e-4}}
    return Trajectory(time, {**columns, "body/z [m]": z}, meta)


@pytest.mark.parametrize("ending", ENDINGS)
def test_round_trip_is_exact(ending: str, tmp_path: Path) -> None:
    log = awkward()
    back = open_log(export(log, tmp_path / f"log.{ending}"))
    assert back.headers == log.headers
    assert back.time.tobytes() == log.time.tobytes()
    for name in log.names:
        assert back[name].tobytes() == log[name].tobytes(), name
    assert back.meta == log.meta


@pytest.mark.parametrize("ending", ENDINGS)
def test_logs_of_every_format_are_logs(ending: str, tmp_path: Path) -> None:
    log = read_log(export(robot_log(), tmp_path / f"log.{ending}"))
    assert log.meta["kind"] == "robot" and log.meta["name"] == "log"


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("cut", [0, 1, 2])
def test_damaged_files_are_told(ending: str, cut: int, tmp_path: Path) -> None:
    path = export(robot_log(60), tmp_path / f"log.{ending}")
    whole = path.read_bytes()
    half = len(whole) // 2
    path.write_bytes([whole[:half], b"", whole[:half] + b"\0" * 64 + whole[half + 64 :]][cut])
    try:
        log = open_log(path)
    except KembaError as error:
        assert "log." + ending in str(error)
    else:  # 64 zeros may lie in a place that no reader looks at; whole chunks of an MCAP are read
        assert cut == 2 or (ending == "mcap" and "breaks off" in log.meta["read"][0])


def test_mcap_is_what_viewers_read(tmp_path: Path) -> None:
    """A topic per part with a JSON Schema that names units; stamps of the log's clock."""
    path = export(robot_log(20), tmp_path / "log.mcap")
    with path.open("rb") as stream:
        reader = make_reader(stream)
        found = [(s, c, m) for s, c, m in reader.iter_messages(topics=["/front/hip"])]
    schema, channel, message = found[3]
    assert schema is not None and schema.encoding == "jsonschema"
    assert json.loads(schema.data)["properties"]["tau"]["description"] == "[N.m]"
    assert channel.message_encoding == "json"
    assert message.log_time == 3_000_000
    assert set(json.loads(message.data)) == {"time", "q", "tau"}


def test_an_mcap_has_the_summary_that_viewers_start_from(tmp_path: Path) -> None:
    """PlotJuggler gives up without a summary, statistics and a schema for every channel;
    Foxglove wants schemas of objects, and seeks by the index of chunks."""
    path = export(robot_log(20), tmp_path / "log.mcap")
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None and summary.statistics is not None and summary.chunk_indexes
    assert summary.statistics.message_count == 20 * len(summary.channels)
    for channel in summary.channels.values():
        assert json.loads(summary.schemas[channel.schema_id].data)["type"] == "object"


def test_an_mcap_of_others_becomes_columns(tmp_path: Path) -> None:
    """Topics at different rates: the slower one is read where it was measured."""
    path = tmp_path / "other.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        fast, slow = (writer.register_channel(t, "json", 0) for t in ("/fast", "/slow"))
        for i in range(10):
            stamp = 10**18 + i * 10**6
            writer.add_message(fast, stamp, json.dumps({"position": [i, 2 * i]}).encode(), stamp)
            if i % 5 == 2:
                writer.add_message(slow, stamp, json.dumps({"load": i}).encode(), stamp)
        writer.finish()
    columns = {
        "time [s]": ColumnSource(source="time", unit="ns"),
        "piston/x [m]": ColumnSource(source="/fast/position/1", unit="mm"),
        "piston/F [N]": ColumnSource(source="/slow/load"),
    }
    log = open_log(path, ColumnMap(kind="bench", origin="first", columns=columns))
    assert log.time == pytest.approx(np.arange(10) * 1e-3, abs=1e-12)
    assert log["piston/x"] == pytest.approx(np.arange(10) * 2e-3)
    assert log["piston/F"][[2, 7]].tolist() == [2.0, 7.0]
    assert np.isnan(np.delete(log["piston/F"], [2, 7])).all()
    assert "have a clock of their own" in log.meta["read"][0]


def test_a_mat_file_of_others_is_mapped(tmp_path: Path) -> None:
    """Vectors of the usual length are columns; matrices, texts and scalars are not."""
    t = np.arange(30) * 1e-3
    content = {"t": t, "qm": t[:, None] * 2, "vir": t**2, "note": "EMPS", "gtau": 35.15}
    savemat(tmp_path / "drive.mat", content)
    columns = {
        "time [s]": ColumnSource(source="t"),
        "piston/x [m]": ColumnSource(source="qm"),
        "piston/F [N]": ColumnSource(source="vir", scale=35.15),
    }
    log = open_log(tmp_path / "drive.mat", ColumnMap(columns=columns))
    assert log["piston/F"] == pytest.approx(35.15 * t**2)
    with pytest.raises(KembaError, match="kemba-opt map"):
        open_log(tmp_path / "drive.mat")


def _npz(path: Path, **changes: object) -> None:
    time = np.arange(3) * 1e-3
    content = {"time": time, "units": np.array(["m"]), "meta": "{}", "piston/x": time}
    np.savez(path, **{k: v for k, v in {**content, **changes}.items() if v is not None})


def _parquet(path: Path, note: bytes = b"{}", **columns: object) -> None:
    table = pa.table({"time [s]": [0.0, 0.001, 0.002], **columns})
    pq.write_table(table.replace_schema_metadata({b"kemba": note}), path)


def _mcap(path: Path, *messages: bytes, note: dict[str, str] | None = None) -> None:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel("/piston", "json", 0)
        for stamp, message in enumerate(messages):
            writer.add_message(channel, stamp, message, stamp)
        if note is not None:
            writer.add_metadata("kemba", note)
        writer.finish()


NOTE = {"headers": '["piston/x [m]"]', "meta": "{}"}
ODD = {
    "units.npz": (_npz, {"units": np.array(["m", "N"])}, "2 units for 1 columns"),
    "no-units.npz": (_npz, {"units": np.zeros(0)}, "0 units for 1 columns"),
    "short.npz": (_npz, {"piston/x": np.zeros(2)}, r"'piston/x \[m\]' has the shape \(2,\)"),
    "plane.npz": (_npz, {"time": np.zeros((3, 2))}, "has the shape"),
    "infinite.npz": (_npz, {"piston/x": np.array([0, np.inf, 0])}, "is infinite in row 2"),
    "not-si.npz": (_npz, {"units": np.array(["mm"])}, "is not in SI units"),
    "words.npz": (_npz, {"time": np.array(["a", "b", "c"])}, "holds no numbers"),
    "note.parquet": (_parquet, {"note": b"{"}, "are no JSON"),
    "words.parquet": (_parquet, {"time [s]": ["", "a", "b"]}, "holds no numbers"),
    "dates.parquet": (_parquet, {"time [s]": np.zeros(3, "datetime64[ns]")}, "holds no numbers"),
    "header.parquet": (_parquet, {"x": [1.0, 2.0, 3.0]}, "is malformed"),
}


@pytest.mark.parametrize("name", ODD)
def test_odd_content_is_told(name: str, tmp_path: Path) -> None:
    make, changes, words = ODD[name]
    make(tmp_path / name, **changes)
    with pytest.raises(KembaError, match=words) as error:
        open_log(tmp_path / name)
    assert name in str(error.value)


@pytest.mark.parametrize(
    ("message", "note"),
    [(b"{}", NOTE), (b"[]", NOTE), (b"{", None), (b"[" * 5000, None), (b'{"time": 0}', {}),
     (b'{"time": 0}', {**NOTE, "meta": "["}), (b'{"time": 0, "x": "a"}', NOTE)],
)  # fmt: skip
def test_odd_messages_are_told(message: bytes, note: dict[str, str] | None, tmp_path: Path) -> None:
    _mcap(tmp_path / "log.mcap", message, message, note=note)
    with pytest.raises(KembaError, match=r"log\.mcap"):
        read_log(tmp_path / "log.mcap")


def test_whole_numbers_are_numbers_and_texts_are_left_alone(tmp_path: Path) -> None:
    columns = {"valve/extend [1]": [0, 1, 1], "remark": ["", "late", ""]}
    _parquet(tmp_path / "log.parquet", **columns)
    log = open_log(tmp_path / "log.parquet")
    assert log.names == ("valve/extend",) and log["valve/extend"].tolist() == [0.0, 1.0, 1.0]


def test_damaged_compressed_bytes_are_told(tmp_path: Path) -> None:
    """Every one of them; what is read nevertheless is the log."""
    whole = export(robot_log(30), tmp_path / "log.npz").read_bytes()
    path, told = tmp_path / "damaged.npz", 0
    for at in range(0, len(whole), max(len(whole) // 60, 1)):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 0xFF]) + whole[at + 1 :])
        try:
            open_log(path)
        except KembaError as error:
            told += "damaged.npz" in str(error)
    assert told > 30


def test_a_file_that_kills_its_reader_is_told(tmp_path: Path) -> None:
    """SciPy's compiled reader trusts the type of an array, byte 145: SIGSEGV in SciPy 1.17."""
    path, t = tmp_path / "log.mat", np.arange(30) * 1e-3
    savemat(path, {"time": t, "x": t})
    whole = path.read_bytes()
    path.write_bytes(whole[:145] + b"\x0e" + whole[146:])
    with pytest.raises(KembaError, match=r"log\.mat: is no MATLAB file that can be read"):
        open_log(path)


@pytest.mark.parametrize("ending", ["npz", "parquet", "mcap"])
def test_packed_logs_are_not_unpacked_into_more_than_is_allowed(
    ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = export(robot_log(2000), tmp_path / f"log.{ending}")
    monkeypatch.setattr("kemba.logs.formats.LARGEST", 100_000)
    with pytest.raises(KembaError, match=r"unpacks to .* GB; .* are allowed.*cut it into logs"):
        open_log(path)


def test_packed_zeros_end_the_reader_of_matlab_files_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With less memory than the array would take; there are 8 MB in some kilobytes."""
    child = Path(arrays.__file__).with_name("mat_child.py").read_text(encoding="utf-8")
    other = tmp_path / "mat_child.py"
    other.write_text(child.replace("MEMORY = 6_000_000_000", "MEMORY = 50_000_000"))
    monkeypatch.setattr(arrays, "__file__", str(tmp_path / "matlab.py"))
    few, path = tmp_path / "few.mat", tmp_path / "zeros.mat"
    savemat(few, {"time": np.zeros(100)})
    assert len(arrays.read_mat(few).columns["time"]) == 100
    savemat(path, {"time": np.zeros(1_000_000)}, do_compression=True)
    assert path.stat().st_size < 20_000
    with pytest.raises(KembaError, match=r"is no MATLAB file that can be read"):
        open_log(path)


def test_a_folder_stands_for_its_logs(tmp_path: Path) -> None:
    for name in ("b.csv", "a.csv", "a.meta.yaml"):
        (tmp_path / name).touch()
    (tmp_path / "empty").mkdir()
    alone = tmp_path / "other.parquet"
    assert log_files([alone, tmp_path]) == [alone, tmp_path / "a.csv", tmp_path / "b.csv"]
    with pytest.raises(KembaError, match="is a folder without logs"):
        log_files([tmp_path / "empty"])


def test_the_folder_of_a_recording_is_one_log(tmp_path: Path) -> None:
    """For every verb that takes logs, beside CSV files too."""
    bag = tmp_path / "logs/bag"
    bag.mkdir(parents=True)
    path = export(robot_log(), bag / "bag_0.mcap")
    (bag / "metadata.yaml").write_text("rosbag2_bagfile_information: {version: 5}\n")
    (tmp_path / "logs/a.csv").touch()
    assert log_files([bag]) == [bag]
    assert log_files([tmp_path / "logs"]) == [tmp_path / "logs/a.csv", bag]
    assert np.array_equal(load_source(bag).trajectory["body/z"], open_log(path)["body/z"])
    for verb in ("check", "discover", "compare", "review"):
        done = CliRunner().invoke(app, [verb, str(bag), "--map", str(tmp_path / "none.yaml")])
        assert "none.yaml" in done.stderr and "is a folder" not in done.stderr
    done = CliRunner().invoke(app, ["check", str(bag)])
    assert "bag: front/piston/x is off by" in done.stderr  # the log is read and judged


@pytest.mark.parametrize(
    ("name", "what", "way_out"),
    [
        ("a.bag", "is a bag of ROS 1", "rosbags-convert"),
        ("a.nc", "is a NetCDF file", "Parquet"),
        ("a.hdf5", "is no HDF5 file", "an array for each column"),
        ("a.feather", "is an Arrow file", "Parquet"),
        ("a.XLSX", "is a workbook", "CSV"),
        ("a.csv.gz", "is packed", "unpack"),
    ],
)
@pytest.mark.parametrize("verb", ["check", "map", "compare"])
def test_what_is_not_read_is_named_with_the_way_out(
    verb: str, name: str, what: str, way_out: str, tmp_path: Path
) -> None:
    (tmp_path / name).write_bytes(b"\0\1\2")
    done = CliRunner().invoke(app, [verb, str(tmp_path / name)])
    assert f"{name}: {what}" in done.stderr and way_out in done.stderr
    (tmp_path / "a.foo").write_bytes(b"\0\1\2")
    with pytest.raises(KembaError, match="is no text, and of no format that is known"):
        open_log(tmp_path / "a.foo")


def test_a_plan_is_told_with_its_run(tmp_path: Path) -> None:
    columns = {"body/z [m]": np.ones(9)}
    plan = Trajectory(np.arange(9) * 0.01, columns, {"kind": "plan", "run": "jump-3"})
    path = export(plan, tmp_path / "x.mcap")
    with pytest.raises(KembaError, match=r"is a plan, not a log; .* kemba-opt simulate jump-3$"):
        read_log(path)
    (tmp_path / "manifest.json").touch()
    with pytest.raises(KembaError, match=f"kemba-opt simulate {tmp_path}$"):
        read_log(path)
