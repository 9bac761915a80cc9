"""What a damaged log has lost is said, wherever its format lets it be known."""

import gc
import json
import sqlite3
import struct
import warnings
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from foreign_files import logs_out, robot_log
from loggers import bag, mdf, tdms, ulog

from kemba.errors import KembaError
from kemba.identify.logs.reading import read_log
from kemba.logs.foreign import raw_columns
from kemba.logs.formats import arrays, mat_child
from kemba.report.export import export

DAMAGED = "it is damaged or breaks off: what is left is read"


def first_row(content: bytes) -> int:
    """Where the first message of data of a ULog begins, by the lengths of those before it."""
    at = 16
    while content[at + 2] != ord("D"):
        at += 3 + struct.unpack_from("<H", content, at)[0]
    return at


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda log: log, ()),
        (lambda log: log[:-1], (DAMAGED,)),
        (lambda log: log[: first_row(log) + 2], None),  # within a length, before any reading
        (lambda log: log + b"\x05", (DAMAGED,)),
        (lambda log: log[: first_row(log) + 2] + b"?" + log[first_row(log) + 3 :], (DAMAGED,)),
    ],
    ids=["whole", "cut", "cut in the head", "a byte more", "unknown message"],
)
def test_ulog(
    change: Callable[[bytes], bytes],
    said: tuple[str, ...] | None,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    """pyulog leaves out what it cannot read, and at most prints it."""
    file = ulog(robot_log(40), tmp_path / "log.ulg")
    file.write_bytes(change(file.read_bytes()))
    if said is None:
        with pytest.raises(KembaError, match=DAMAGED):
            raw_columns(file, None)
    else:
        assert raw_columns(file, None).remarks == said
    assert capfd.readouterr() == ("", "")


def test_what_crash_recovery_appends_to_a_ulog_is_no_damage(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The last message before it may be broken, as the specification says."""
    file = ulog(robot_log(40), tmp_path / "log.ulg")
    file.write_bytes(file.read_bytes()[:-1])
    monkeypatch.setattr("pyulog.ULog.has_data_appended", True)
    assert raw_columns(file, None).remarks == ()


def test_messages_of_a_bag_that_are_of_no_topic(tmp_path: Path) -> None:
    file = bag(tmp_path / "log.db3", rows=40)
    with closing(sqlite3.connect(file)) as base:
        base.execute("UPDATE messages SET topic_id = 9 WHERE id < 3")
        base.execute("INSERT INTO topics VALUES (7, '/image', 'a/b', 'other')")
        base.execute("UPDATE messages SET topic_id = 7 WHERE id = 3")
        base.commit()
    found = raw_columns(file, None)
    assert len(found.columns["time"]) == 36
    assert found.remarks == (
        "topic /image is not read: its messages are other of a/b",
        "it is damaged: 3 messages are of topics that it does not list",
    )


def test_channels_without_readings(tmp_path: Path) -> None:
    """A TDMS file that breaks off, and one whose lengths do not fit its data."""
    file = tdms(robot_log(40), tmp_path / "log.tdms")
    content = file.read_bytes()
    at = content.index(b"front_hip_q'") + len(b"front_hip_q'") + 12  # of its number of readings
    assert struct.unpack_from("<Q", content, at) == (40,)
    file.write_bytes(content[:at] + struct.pack("<Q", 2**40) + content[at + 8 :])
    breaks, empty = raw_columns(file, None).remarks
    assert breaks == "it breaks off: its channels end at different times"
    assert empty.startswith("without any reading: ") and empty.endswith(" more")
    file.write_bytes(content[:-400])
    assert raw_columns(file, None).remarks == (
        "it breaks off: its channels end at different times",
        "without any reading: rear_valve_retract",
    )


def test_data_of_tdms_that_are_of_no_channel(tmp_path: Path) -> None:
    """Under a name in which the marks between group and channel are damaged."""
    file = tdms(robot_log(40), tmp_path / "log.tdms", "Time")
    content = file.read_bytes()
    assert content.count(b"/'log'/'rear_hip_q'") == 1
    file.write_bytes(content.replace(b"/'log'/'rear_hip_q'", b"/'log___rear_hip_q'"))
    found = raw_columns(file, None)
    assert "rear_hip_q" not in found.columns
    assert found.remarks[0] == "it is damaged: 1 objects with data are no channels"


def test_a_group_of_mdf_that_is_shorter_than_it_says(tmp_path: Path) -> None:
    file = mdf(robot_log(40), tmp_path / "log.mf4")
    content = file.read_bytes()
    at = content.rindex(b"##CG") + 80  # its number of readings, behind a head of 24 and 7 words
    assert struct.unpack_from("<Q", content, at) == (40,)
    file.write_bytes(content[:at] + struct.pack("<Q", 50) + content[at + 8 :])
    found = raw_columns(file, None)
    assert found.remarks == ("it breaks off: 40 of 50 readings of a group are there",)
    assert len(found.columns["time"]) == 40
    at = content.index(b"##DT")
    file.write_bytes(content[:at] + bytes(4) + content[at + 4 :])
    found = raw_columns(file, None)
    assert found.remarks == ("it breaks off: 0 of 4 readings of a group are there",)
    assert "body_x" not in found.columns


def test_of_a_damaged_file_nothing_else_is_printed(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """asammdf prints a report of what it cannot read, and fails once more when it is dropped."""
    content = mdf(robot_log(40), tmp_path / "log.mf4").read_bytes()
    name = content.rindex(b"rear_hip_q")  # a channel without a name is reported
    for number, at in enumerate((0, content.index(b"##HD"), content.rindex(b"##CN"), name)):
        file = tmp_path / f"log{number}.mf4"
        file.write_bytes(content[:at] + bytes(16) + content[at + 16 :])
        with pytest.raises(KembaError, match="is damaged, or no"):
            raw_columns(file, None)
    gc.collect()
    assert capfd.readouterr() == ("", "")


def test_what_matlab_files_leave_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Objects that mat-io does not know, by its own words, and series of other lengths."""
    file = logs_out(robot_log(40), tmp_path / "log.mat")
    whole = arrays._sorted_out(file)
    assert raw_columns(file, None).remarks == () and whole[0]["warnings"] == []
    shorter = {**whole[1], "a1": whole[1]["a1"][:-1]}
    index = {**whole[0], "warnings": ["Unknown property type 7", "Failed to load"]}
    monkeypatch.setattr(arrays, "_sorted_out", lambda _: (index, shorter))
    assert raw_columns(file, None).remarks == (
        "left out, since they are not as long as their times: body/x",
        "damaged, or of a newer MATLAB: Unknown property type 7; Failed to load",
    )


def test_warnings_of_mat_io_are_passed_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of other packages are not."""
    warning = pytest.importorskip("matio.utils.matclass").MatReadWarning

    def content(path: str) -> dict[str, np.ndarray]:
        for category in (warning, warning, UserWarning):
            warnings.warn("Unknown property type 7", category, stacklevel=1)
        return {"x": np.arange(3.0)}

    monkeypatch.setattr(mat_child, "content", content)
    monkeypatch.setattr(mat_child, "limit_memory", lambda: None)
    monkeypatch.setattr("sys.argv", ["", "log.mat", str(tmp_path / "out")])
    assert mat_child.main() == 0
    index = json.loads(str(np.load(tmp_path / "out")))
    assert index["warnings"] == ["Unknown property type 7"]


def test_vectors_without_entries_are_no_log(tmp_path: Path) -> None:
    """SciPy takes a damaged head for an old version, and reads one odd variable."""
    np.savez(tmp_path / "log.npz", time=np.zeros(0), x=np.zeros(0))
    with pytest.raises(KembaError, match="holds no vector of numbers: 'time' of shape"):
        raw_columns(tmp_path / "log.npz", None)
    file = logs_out(robot_log(40), tmp_path / "log.mat")
    file.write_bytes(bytes(16) + file.read_bytes()[16:300])
    with pytest.raises(KembaError, match=r"log\.mat"):
        raw_columns(file, None)


def test_a_changed_byte_in_our_parquet_is_known(tmp_path: Path) -> None:
    """Pages have checksums; a changed reading would else be read."""
    file = export(robot_log(), tmp_path / "log.parquet")
    content = file.read_bytes()
    assert read_log(file)
    at = len(content) // 2
    file.write_bytes(content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :])
    with pytest.raises(KembaError, match="CRC"):
        read_log(file)
