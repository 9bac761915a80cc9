"""Logs as MCAP: written for PlotJuggler and Foxglove with JSON, read with most encodings."""

from __future__ import annotations

import json
import math
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from mcap.records import Channel, DataEnd, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

from kemba.errors import KembaError
from kemba.files import atomic_path, plain
from kemba.logs.formats import check_size, missing
from kemba.logs.formats.decoding import Topic, decoder
from kemba.logs.recording import Recording, recording
from kemba.trajectory import TIME, Trajectory

META = "kemba"
NS = 1_000_000_000


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


def read_mcap(path: Path) -> Recording:
    """Our own MCAP exactly; else every number of messages in JSON, ROS 2 CDR or protobuf as a
    column `topic/field`, each topic on its own clock.

    Of a file that was cut off, what whole chunks hold. Raises KembaError where nothing is read.
    """
    topics: dict[str, Topic] = {}
    skipped: dict[str, str] = {}
    known: dict[str, dict[str, str]] = {}
    said: list[str] = []
    try:
        with path.open("rb") as stream:
            for record in _records(stream, path, said):
                if isinstance(record, Metadata):
                    known[record.name] = record.metadata
                else:
                    schema, channel, message = record
                    _take(schema, channel, message, topics, skipped)
    except OSError as error:
        raise KembaError(str(path), error.strerror or str(error)) from None
    except ImportError as error:
        raise missing(path, error) from None
    if not topics:
        raise _nothing(path, skipped, said)
    said += [f"topic {name} is not read: {why}" for name, why in skipped.items()]
    if META not in known:
        groups = [topic.group() for topic in topics.values() if topic.columns]
        return recording(groups, said)
    try:
        return replace(_own(topics, known[META]), remarks=tuple(said))
    except (ValueError, TypeError, KeyError, AttributeError):
        what = "its metadata 'kemba' do not fit its messages"
        raise KembaError(str(path), what, "what kemba-opt export writes was expected") from None


def _nothing(path: Path, skipped: dict[str, str], said: list[str]) -> KembaError:
    if skipped:
        listed = "; ".join(f"{name}: {why}" for name, why in list(skipped.items())[:4])
        return KembaError(str(path), f"has no message that kemba reads: {listed}")
    broken = said[0] if said else "it has no messages"
    return KembaError(str(path), f"is no MCAP file with messages: {broken}")


def _records(stream: Any, path: Path, said: list[str]) -> Iterator[Any]:
    """Messages with their schema and channel, and metadata, until the file ends or breaks off."""
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    size = count = 0
    ended = False
    try:
        for record in StreamReader(stream, validate_crcs=True).records:
            if isinstance(record, Schema):
                schemas[record.id] = record
            elif isinstance(record, Channel):
                channels[record.id] = record
            elif isinstance(record, Metadata):
                yield record
            elif isinstance(record, Message):
                size, count = size + len(record.data), count + 1
                check_size(path, size)
                channel = channels[record.channel_id]
                yield schemas.get(channel.schema_id), channel, record
            ended = ended or isinstance(record, DataEnd)
    except KembaError:
        raise
    except Exception as error:  # of damaged bytes the library raises anything
        if not ended:
            why = f"{type(error).__name__}: {error}"[:120]
            said.append(f"it breaks off after {count} messages, which are read ({why})")
        return
    if not ended:
        said.append(f"it breaks off after {count} messages, which are read")


def _take(
    schema: Any, channel: Any, message: Any, topics: dict[str, Topic], skipped: dict[str, str]
) -> None:
    topic = topics.get(channel.topic)
    if topic is None:
        if channel.topic in skipped:
            return
        decode = decoder(channel.message_encoding, schema)
        if decode is None:
            kind = f" of {schema.encoding}" if schema else " without a schema"
            said = f"its messages are {channel.message_encoding or 'bytes'}{kind}"
            skipped[channel.topic] = f"{said}; JSON, ROS 2 CDR and protobuf are read"
            return
        topic = topics[channel.topic] = Topic(channel.topic, decode)
    topic.add(message.log_time, topic.decode(message.data))


def _own(topics: dict[str, Topic], note: dict[str, str]) -> Recording:
    """Columns in the order of the note, and the metadata."""
    time = next(iter(topics.values())).columns["time"]
    columns = {header: _field(topics, header, len(time)) for header in json.loads(note["headers"])}
    return Recording({TIME: np.array(time), **columns}, json.loads(note["meta"]))


def _field(topics: dict[str, Topic], header: str, rows: int) -> np.ndarray[Any, Any]:
    topic, _, field = ("/" + header.split(" [")[0]).rpartition("/")
    found = topics[topic or "/"]
    if field in found.texts:
        raise ValueError(header)
    values, column = found.columns.get(field, np.zeros(0)), np.full(rows, np.nan)
    column[: len(values)] = values
    return column
