"""Logs as MCAP: written for PlotJuggler and Foxglove with JSON, read with most encodings."""

from __future__ import annotations

import json
import math
from array import array
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from mcap.records import Channel, DataEnd, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

from kemba.errors import KembaError
from kemba.files import atomic_path, plain
from kemba.logs.formats import check_size, missing
from kemba.logs.recording import Group, Raw, Recording, recording
from kemba.trajectory import TIME, Trajectory

Decode = Callable[[bytes], Any]
NUMBERS = (bool, int, float, np.number)
KNOWN: dict[type, tuple[str, ...]] = {}  # fields of the classes of messages that were met
NS = 1_000_000_000
# where messages say when they were sent: whole seconds, and ns
HEADERS = (
    ("header/stamp/sec", "header/stamp/nanosec"),
    ("header/stamp/secs", "header/stamp/nsecs"),
    ("header/stamp/sec", "header/stamp/nsec"),
    ("timestamp/seconds", "timestamp/nanos"),
    ("timestamp/sec", "timestamp/nsec"),
)
SAME_CLOCK = 0.5  # s; a message that took longer was stamped by another clock


class Topic:
    """Messages of one topic as they come in: stamps [ns], and numbers by path.

    Messages of one shape are kept side by side, so that the paths are put together once a shape.
    """

    def __init__(self, name: str, decode: Decode = json.loads) -> None:
        self.name, self.decode = name, decode
        self.stamps: list[int] = []
        self._shapes: dict[tuple[Any, ...], _Shape] = {}

    def add(self, stamp: int, message: Any) -> None:
        """Append a message; fields that come later than others are missing before."""
        numbers, signs = array("d"), list[Any]()
        _leaves(message, numbers, signs)
        key = tuple(signs)
        shape = self._shapes.get(key)
        if shape is None:
            shape = self._shapes[key] = _Shape([name for name, _ in flat(message)])
            shape.texts = {n for n, value in flat(message) if isinstance(value, str)}
        shape.numbers.extend(numbers)
        shape.rows.append(len(self.stamps))
        self.stamps.append(stamp)

    @cached_property
    def texts(self) -> set[str]:
        """Paths of texts, once all messages are in."""
        return {name for shape in self._shapes.values() for name in shape.texts}

    @cached_property
    def columns(self) -> Raw:
        """The numbers (n,) by path, NaN where a message has none, once all messages are in."""
        found: Raw = {}
        for shape in self._shapes.values():
            table = np.frombuffer(shape.numbers).reshape(len(shape.rows), len(shape.names))
            rows = np.array(shape.rows)
            for name, values in zip(shape.names, table.T, strict=True):
                if name in shape.texts:
                    continue
                if name not in found:
                    found[name] = np.full(len(self.stamps), np.nan)
                found[name][rows] = values
        self._shapes = {key: replace(s, numbers=array("d")) for key, s in self._shapes.items()}
        return found

    def group(self, said: list[str]) -> Group:
        """The topic in the order of its stamps, equal ones once; what a reader has to know of them
        is `said`."""
        stamps = self._stamps(said)
        order = np.argsort(stamps, kind="stable")
        order = order[np.concatenate([[True], np.diff(stamps[order]) > 0])]
        if len(order) == len(stamps) and np.all(np.diff(order) > 0):
            return Group(self.name, stamps, "ns", self.columns)
        if left := len(stamps) - len(order):
            said.append(
                f"{left} of {len(stamps)} messages of {self.name} have the stamp of another one "
                "and are left out"
            )
        columns = {name: values[order] for name, values in self.columns.items()}
        return Group(self.name, stamps[order], "ns", columns)

    def _stamps(self, said: list[str]) -> np.ndarray[Any, np.dtype[np.int64]]:
        """When the messages (n,) were sent [ns], by their headers; when they were written, where
        they have none or these are of another clock."""
        written = np.array(self.stamps, dtype=np.int64)
        for whole, rest in HEADERS:
            if not {whole, rest} <= set(self.columns):
                continue
            parts = self.columns[whole], self.columns[rest]
            if not all(np.isfinite(part).all() for part in parts):
                continue
            sent = parts[0].astype(np.int64) * NS + parts[1].astype(np.int64)
            late = float(np.median(written - sent)) / NS
            # else the header is not set anew for each message
            fewer = np.count_nonzero(np.diff(sent)) < np.count_nonzero(np.diff(written))
            if abs(late) > SAME_CLOCK or fewer or np.array_equal(sent, written):
                continue
            said.append(
                f"the times of {self.name} are those of its headers, "
                f"{1e3 * abs(late):.3g} ms {'after' if late < 0 else 'before'} they were written"
            )
            return sent
        return written


@dataclass
class _Shape:
    """Messages whose numbers and texts have the same paths `names` (k,): their `rows` (m,), and
    their `numbers` (m k,), NaN for a text."""

    names: list[str]
    texts: set[str] = field(default_factory=set)
    rows: list[int] = field(default_factory=list)
    numbers: array[float] = field(default_factory=lambda: array("d"))


def decoder(encoding: str, schema: Any) -> Decode | None:
    """What turns the bytes of a message into an object; None where nothing here reads them."""
    if encoding == "json":
        return json.loads
    if encoding == "cdr" and schema is not None:
        return _cdr(schema.name, schema.encoding, schema.data.decode(errors="replace"))
    if encoding == "protobuf" and schema is not None:
        return _protobuf(schema.name, schema.data)
    return None


def _cdr(name: str, encoding: str, text: str) -> Decode | None:
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    store = get_typestore(Stores.EMPTY)
    if encoding == "ros2msg":
        store.register(get_types_from_msg(text, name))
    elif encoding == "ros2idl":
        store.register(get_types_from_idl(text))
    else:
        return None
    return lambda data: store.deserialize_cdr(data, name)


def cdr_of_store(name: str) -> Decode | None:
    """The same for a type that ROS 2 itself brings; None of the user's own."""
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.LATEST)
    if name not in store.types:
        return None
    return lambda data: store.deserialize_cdr(data, name)


def _protobuf(name: str, data: bytes) -> Decode:
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(data).file:
        pool.Add(file)
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName(name))
    return lambda data: kind.FromString(data)


def flat(value: Any, name: str = "") -> Iterator[tuple[str, float | str]]:
    """The numbers and texts of a message by their path: `position/0`, or `position/knee` where it
    names its entries as a JointState does."""
    if isinstance(value, bool | int | float | np.number):
        yield name, float(value)
        return
    if isinstance(value, str):
        yield name, value
        return
    items = _items(value)
    names = _entries(items)
    for key, item in items.items():
        path = f"{name}/{key}".strip("/")
        if names and key != "name" and _length(item) == len(names):
            for entry, part in zip(names, item, strict=True):
                yield from flat(part, f"{path}/{entry}")
        else:
            yield from flat(item, path)


def _leaves(value: Any, numbers: array[float], signs: list[Any]) -> None:
    """Append the numbers of a message in the order of `flat`, NaN for a text, and signs of its
    shape: keys, lengths, and the names of entries."""
    kind = type(value)
    if kind is np.ndarray and value.ndim == 1 and value.dtype.kind in "fiub":
        numbers.frombytes(value.astype(np.float64, copy=False).tobytes())
        signs.append(len(value))
    elif kind is list and not value:
        signs.append(0)
    elif kind is str:
        numbers.append(np.nan)
        signs.append("")
    elif isinstance(value, NUMBERS):
        numbers.append(float(value))
        signs.append("number")
    else:
        keys = KNOWN[kind] if kind in KNOWN else _fields(kind)
        if keys and "name" not in keys:
            signs.append(keys)
            values: Iterable[Any] = [getattr(value, key) for key in keys]
        else:
            items = _items(value)
            signs.append((*items, *_entries(items)) if "name" in items else tuple(items))
            values = items.values()
        for item in values:
            if type(item) in (float, int):  # most are, and a call takes longer than all else
                numbers.append(item)
                signs.append("number")
            else:
                _leaves(item, numbers, signs)


def _fields(kind: type) -> tuple[str, ...]:
    """The fields of a class of messages; none of what is no dataclass."""
    if kind not in KNOWN:
        known = getattr(kind, "__dataclass_fields__", ())
        KNOWN[kind] = tuple(key for key in known if key[0] != "_")
    return KNOWN[kind]


def _items(value: Any) -> Mapping[str, Any]:
    if fields := KNOWN.get(type(value)) or _fields(type(value)):
        return {key: getattr(value, key) for key in fields}
    if isinstance(value, dict):
        return value
    if hasattr(value, "DESCRIPTOR"):
        return {field.name: getattr(value, field.name) for field in value.DESCRIPTOR.fields}
    return {str(i): item for i, item in enumerate(value)} if _length(value) > 0 else {}


def _entries(items: Mapping[str, Any]) -> list[str]:
    """The texts under `name`, if each other list is as long."""
    found = items.get("name")
    if isinstance(found, list | tuple) and found and all(isinstance(n, str) and n for n in found):
        return list(found)
    return []


def _length(value: Any) -> int:
    """Of a list of any kind, as a repeated field of protobuf, else -1."""
    listed = hasattr(value, "__len__") and not isinstance(value, str | bytes | dict)
    return len(value) if listed else -1


META = "kemba"


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
        groups = [topic.group(said) for topic in topics.values() if topic.columns]
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
            why = f" ({error})"[:120] if str(error) else ""
            said.append(f"it breaks off after {count} messages, which are read{why}")
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
