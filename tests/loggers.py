"""Logs as data loggers, simulators and middleware write them: MDF, TDMS, ULog, LabVIEW, OpenSim,
bags of ROS 2, MCAP."""

import sqlite3
import struct
from contextlib import closing
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foreign_files import robot_log
from mcap.writer import CompressionType, Writer

from kemba.trajectory import Trajectory

LEGS = ("front", "rear")
START = 1_766_147_454_000_000_000  # ns since 1970
JOINTS = ["front_hip", "rear_hip"]
JOINT_STATE = "sensor_msgs/msg/JointState"


def columns_of(log: Trajectory) -> dict[str, np.ndarray]:
    """The columns (n,) by names without slashes."""
    return {name.replace("/", "_"): log[name] for name in log.names}


def _unit(name: str) -> str:
    return "deg" if name.endswith(("_q", "pitch")) else "Nm" if name.endswith("tau") else ""


def mdf(log: Trajectory, path: Path) -> Path:
    """Two groups at their own rates, units as the file states them."""
    asammdf = pytest.importorskip("asammdf")
    slow = slice(None, None, 10)
    with asammdf.MDF() as file:
        body = {n: v for n, v in columns_of(log).items() if n.startswith("body")}
        rest = {n: v for n, v in columns_of(log).items() if n not in body}
        for part, rows in ((body, slow), (rest, slice(None))):
            signals = []
            for name, values in part.items():
                shown = np.degrees(values) if _unit(name) == "deg" else values
                signal = asammdf.Signal(shown[rows], log.time[rows], name=name, unit=_unit(name))
                signals.append(signal)
            file.append(signals)
        file.save(path)
    return path


def tdms(log: Trajectory, path: Path, clock: str = "") -> Path:
    """Waveforms with increments and offsets of their own; else a channel of times of this name,
    and one that is not as long."""
    nptdms = pytest.importorskip("nptdms")
    waveform, channels = not clock, []
    for name, values in columns_of(log).items():
        step = 10 if waveform and name.startswith("body") else 1
        late = 0.004 if step == 10 else 0.0
        shown = np.interp(log.time + late, log.time, values)[::step] if step == 10 else values
        start = np.datetime64("2026-01-01T12:00:00")
        given = {"wf_increment": 1e-3 * step, "wf_start_offset": late, "wf_start_time": start}
        given = given if waveform else {}
        channels.append(nptdms.ChannelObject("log", name, shown, properties=given))
    if not waveform:
        channels.append(nptdms.ChannelObject("log", clock, log.time))
        channels.append(nptdms.ChannelObject("log", "short", log.time[1:]))
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(channels)
    return path


def ulog(log: Trajectory, path: Path) -> Path:
    """Messages at their own rates; pyulog has no writer from arrays, so that the bytes are laid out
    here as its specification says."""
    columns = columns_of(log)
    body = {n: v for n, v in columns.items() if n.startswith("body")}
    legs = {n: v for n, v in columns.items() if n not in body}
    blocks = [b"\x55\x4c\x6f\x67\x01\x12\x35\x01" + struct.pack("<Q", 0)]
    parts = ((0, "mocap", body, 10), (1, "legs", legs, 1))
    for _, name, part, _ in parts:
        fields = ";".join(["uint64_t timestamp", *(f"double {n}" for n in part)]) + ";"
        blocks.append(_message("F", f"{name}:{fields}".encode()))
    for number, name, _, _ in parts:
        blocks.append(_message("A", struct.pack("<BH", 0, number) + name.encode()))
    for row in range(len(log)):
        for number, _, part, step in parts:
            if row % step == 0:
                values = [part[n][row] for n in part]
                stamp = round(1e6 * log.time[row]) + 5_000_000
                data = struct.pack(f"<HQ{len(values)}d", number, stamp, *values)
                blocks.append(_message("D", data))
    path.write_bytes(b"".join(blocks))
    return path


def _message(kind: str, data: bytes) -> bytes:
    return struct.pack("<HB", len(data), ord(kind)) + data


def lvm(log: Trajectory, path: Path) -> Path:
    """LabVIEW with decimal commas and a comment behind the numbers."""
    columns = columns_of(log)
    units = [{"m": "mm", "rad": "deg", "N.m": "N.m", "1": ""}[log.unit(n)] for n in log.names]
    sizes = [{"mm": 1e3, "deg": np.degrees(1)}.get(unit, 1.0) for unit in units]
    head = ["LabVIEW Measurement", "Writer_Version\t2", "Separator\tTab", "Decimal_Separator\t,",
            "***End_of_Header***", "", f"Channels\t{len(columns)}",
            "\t".join(["Y_Unit_Label", *units]), "***End_of_Header***",
            "\t".join(["X_Value", *columns, "Comment"])]  # fmt: skip
    rows = []
    for i, time in enumerate(log.time):
        cells = [time, *(v[i] * size for v, size in zip(columns.values(), sizes, strict=True))]
        rows.append("\t".join(f"{cell:.9g}".replace(".", ",") for cell in cells) + "\t")
    path.write_text("\n".join([*head, *rows]) + "\n")
    return path


def opensim(path: Path, rows: int = 300) -> Path:
    """y is up, z to the side, angles, and these alone, in degrees by the header."""
    t = np.arange(rows) * 1e-3
    columns = {
        "pelvis_tx": 0.1 * t, "pelvis_ty": 0.9 + 0.1 * np.sin(9 * t), "pelvis_tz": 1e-3 * t,
        "pelvis_tilt": np.degrees(0.1 * np.sin(8 * t)), "hip_front_q": np.degrees(np.sin(7 * t)),
        "piston_front_length_x": 0.03 + 0.03 * np.sin(9 * t), "hip_front_torque": 5 * np.sin(t),
        "piston_front_force": 90 * np.sin(t),
    }  # fmt: skip
    head = ["log", "version=1", f"nRows={rows}", f"nColumns={len(columns) + 1}", "inDegrees=yes",
            "endheader", "\t".join(["time", *columns])]  # fmt: skip
    table = ["\t".join(f"{v:.9g}" for v in row) for row in zip(t, *columns.values(), strict=True)]
    path.write_text("\n".join([*head, *table]))
    return path


@cache
def _store() -> Any:
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.LATEST)


def _cdr(header: float, names: list[str], position: np.ndarray, effort: np.ndarray) -> bytes:
    store = _store()
    stamp = round(header * 1e9)
    time = store.types["builtin_interfaces/msg/Time"](stamp // 10**9, stamp % 10**9)
    top = store.types["std_msgs/msg/Header"](time, "base")
    joints = store.types[JOINT_STATE](top, names, position, np.zeros(0), effort)
    return bytes(store.serialize_cdr(joints, JOINT_STATE))


def _definition() -> str:
    return str(_store().generate_msgdef(JOINT_STATE, ros_version=2)[0])


def joint_rows(rows: int = 400) -> list[bytes]:
    """A JointState of both hips for each row of the robot's log."""
    log = robot_log(rows)
    both = [np.stack([log[f"{leg}/{c}"] for leg in LEGS], axis=1) for c in ("hip/q", "hip/tau")]
    return [_cdr(t, JOINTS, q, tau) for t, q, tau in zip(log.time, *both, strict=True)]


def mcap_of_ros2(path: Path, rows: int = 400) -> Path:
    """What rosbag2 records by default, in chunks of 4 kB."""
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=4096, compression=CompressionType.ZSTD)
        writer.start(profile="ros2")
        schema = writer.register_schema(JOINT_STATE, "ros2msg", _definition().encode())
        channel = writer.register_channel("/joint_states", "cdr", schema)
        for row, data in enumerate(joint_rows(rows)):
            stamp = START + row * 10**6
            writer.add_message(channel, stamp, data, stamp)
        writer.finish()
    return path


def bag(path: Path, defined: bool = True, rows: int = 400) -> Path:
    """The SQLite file of a bag, with or without definitions of its messages."""
    with closing(sqlite3.connect(path)) as base:
        base.execute(
            "CREATE TABLE topics(id INTEGER, name TEXT, type TEXT, serialization_format TEXT)"
        )
        base.execute(
            "CREATE TABLE messages(id INTEGER, topic_id INTEGER, timestamp INTEGER, data BLOB)"
        )
        base.execute("INSERT INTO topics VALUES (1, '/joint_states', ?, 'cdr')", (JOINT_STATE,))
        if defined:
            base.execute("CREATE TABLE message_definitions(topic_type TEXT, encoding TEXT, "
                         "encoded_message_definition TEXT)")  # fmt: skip
            base.execute(
                "INSERT INTO message_definitions VALUES (?, 'ros2msg', ?)",
                (JOINT_STATE, _definition()),
            )
        found = [(i, 1, START + i * 10**6, data) for i, data in enumerate(joint_rows(rows))]
        base.executemany("INSERT INTO messages VALUES (?, ?, ?, ?)", found)
        base.commit()
    return path
