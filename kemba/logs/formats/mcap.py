"""Logs as MCAP, for PlotJuggler and Foxglove: one topic per part, messages in JSON."""

from __future__ import annotations

import json
import math
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.writer import Writer

from kemba.errors import KembaError
from kemba.files import atomic_path, plain
from kemba.logs.formats import check_size
from kemba.logs.text import Raw
from kemba.trajectory import TIME, Trajectory

META = "kemba"
NS = 1_000_000_000
# Stamps of one instant may differ by jitter of the recorder; later messages are another row.
Messages = dict[str, tuple[list[int], list[Any]]]


def write_mcap(trajectory: Trajectory, path: Path) -> None:
    """Topics `/front/hip` with fields `q`, `tau` and the exact `time`; units in the schema."""
    topics: dict[str, list[str]] = defaultdict(list)
    for name in trajectory.names:
        topics["/" + name.rpartition("/")[0]].append(name)
    order = {"headers": json.dumps(trajectory.headers), "meta": json.dumps(plain(trajectory.meta))}
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="", library="kemba")
        channels = {t: _channel(writer, trajectory, t, names) for t, names in topics.items()}
        for row, time in enumerate(trajectory.time.tolist()):
            stamp = max(round((time - min(float(trajectory.time[0]), 0.0)) * NS), 0)
            for topic, names in topics.items():
                fields = {n.rpartition("/")[2]: trajectory[n].item(row) for n in names}
                message = {"time": time, **{k: v for k, v in fields.items() if not math.isnan(v)}}
                data = json.dumps(message, allow_nan=False).encode()
                writer.add_message(channels[topic], stamp, data, stamp, row)
        writer.add_metadata(META, order)
        writer.finish()  # type: ignore[no-untyped-call]


def _channel(writer: Writer, trajectory: Trajectory, topic: str, names: list[str]) -> int:
    fields = {
        name.rpartition("/")[2]: {"type": "number", "description": f"[{trajectory.unit(name)}]"}
        for name in names
    }
    schema = {
        "type": "object",
        "properties": {"time": {"type": "number", "description": "[s]"}, **fields},
    }
    title = "kemba." + (topic.strip("/").replace("/", ".") or "log")
    number = writer.register_schema(title, "jsonschema", json.dumps(schema).encode())
    return writer.register_channel(topic, "json", number)


def read_mcap(path: Path) -> tuple[Raw, dict[str, Any]]:
    """Our own MCAP exactly; else every number of JSON messages as a column `topic/field`.

    Columns of slower topics keep their last value. Raises KembaError where no message is JSON.
    """
    try:
        with path.open("rb") as stream:
            reader = make_reader(stream)
            summary = reader.get_summary()
            chunks = summary.chunk_indexes if summary else ()
            check_size(path, sum(chunk.uncompressed_size for chunk in chunks))
            known = {found.name: found.metadata for found in reader.iter_metadata()}
            topics = _messages(reader)
    except OSError as error:
        raise KembaError(str(path), error.strerror or str(error)) from None
    except (McapError, ValueError, EOFError) as error:
        raise KembaError(str(path), f"is no MCAP file: {error or type(error).__name__}") from None
    if not topics:
        raise KembaError(str(path), "has no messages in JSON", "record with the JSON encoding")
    if META not in known:
        return _joined(topics), {}
    try:
        return _own(topics, known[META])
    except (ValueError, TypeError, KeyError, AttributeError):
        what = "its metadata 'kemba' do not fit its messages"
        raise KembaError(str(path), what, "what kemba-opt export writes was expected") from None


def _own(topics: Messages, note: dict[str, str]) -> tuple[Raw, dict[str, Any]]:
    """Columns in the order of the note, and the metadata."""
    time = [message["time"] for message in next(iter(topics.values()))[1]]
    columns = {header: _field(topics, header) for header in json.loads(note["headers"])}
    return {TIME: np.array(time), **columns}, json.loads(note["meta"])


def _messages(reader: Any) -> Messages:
    topics: Messages = defaultdict(lambda: ([], []))
    for _, channel, message in reader.iter_messages(log_time_order=False):
        if channel.message_encoding == "json":
            topics[channel.topic][0].append(message.log_time)
            topics[channel.topic][1].append(json.loads(message.data))
    return dict(topics)


def _field(topics: Messages, header: str) -> np.ndarray[Any, Any]:
    topic, _, field = ("/" + header.split(" [")[0]).rpartition("/")
    return np.array([message.get(field, math.nan) for message in topics[topic or "/"][1]])


def _joined(topics: Messages) -> Raw:
    """All topics on the stamps of the most frequent one."""
    longest = max(topics, key=lambda topic: len(topics[topic][0]))
    order = np.argsort(topics[longest][0], kind="stable")
    time = [topics[longest][0][i] for i in order]
    found: Raw = {"time": np.array(time, dtype=object)}
    for topic, (stamps, messages) in topics.items():
        rows = [dict(_flat(message)) for message in messages]
        own = np.argsort(stamps, kind="stable")
        last = np.searchsorted(np.array(stamps)[own], np.array(time), side="right") - 1
        for name in dict.fromkeys(key for row in rows for key in row):
            values = np.array([row.get(name, math.nan) for row in rows])[own]
            found[f"{topic}/{name}"] = np.where(last >= 0, values[np.clip(last, 0, None)], math.nan)
    return found


def _flat(value: Any, name: str = "") -> list[tuple[str, float]]:
    """The numbers of a message by their path: `position/0`."""
    if isinstance(value, bool | int | float):
        return [(name, float(value))]
    items = (
        value.items()
        if isinstance(value, dict)
        else enumerate(value)
        if isinstance(value, list)
        else ()
    )
    return [pair for key, item in items for pair in _flat(item, f"{name}/{key}".strip("/"))]
