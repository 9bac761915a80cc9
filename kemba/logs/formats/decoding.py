"""Messages of middleware as numbers by path: JSON, ROS CDR, protobuf."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from kemba.logs.recording import Group, Raw

Decode = Callable[[bytes], Any]


class Topic:
    """Messages of one topic as they come in: stamps [ns], and numbers by path."""

    def __init__(self, name: str, decode: Decode = json.loads) -> None:
        self.name, self.decode = name, decode
        self.stamps: list[int] = []
        self.columns: dict[str, list[float]] = {}
        self.texts: set[str] = set()

    def add(self, stamp: int, message: Any) -> None:
        """Append a message; fields that come later than others are missing before."""
        row = len(self.stamps)
        self.stamps.append(stamp)
        for name, value in flat(message):
            if isinstance(value, str):
                self.texts.add(name)
                continue
            column = self.columns.get(name)
            if column is None:
                column = self.columns[name] = [np.nan] * row
            elif len(column) < row:
                column.extend([np.nan] * (row - len(column)))
            if len(column) == row:
                column.append(value)

    def group(self) -> Group:
        """The topic in the order of its stamps, equal ones once."""
        stamps = np.array(self.stamps, dtype=np.int64)
        order = np.argsort(stamps, kind="stable")
        order = order[np.concatenate([[True], np.diff(stamps[order]) > 0])]
        columns: Raw = {}
        for name, values in self.columns.items():
            values.extend([np.nan] * (len(stamps) - len(values)))
            columns[name] = np.array(values)[order]
        return Group(self.name, stamps[order], "ns", columns)


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


def _items(value: Any) -> Mapping[str, Any]:
    if isinstance(value, dict):
        return value
    if isinstance(value, list | tuple | np.ndarray):
        return {str(i): item for i, item in enumerate(value)}
    if hasattr(value, "__dataclass_fields__"):
        return {key: getattr(value, key) for key in value.__dataclass_fields__ if key[0] != "_"}
    if hasattr(value, "DESCRIPTOR"):
        return {field.name: getattr(value, field.name) for field in value.DESCRIPTOR.fields}
    if hasattr(value, "__len__") and not isinstance(value, str | bytes):
        return {str(i): item for i, item in enumerate(value)}  # a repeated field of protobuf
    return {}


def _entries(items: Mapping[str, Any]) -> list[str]:
    """The texts under `name`, if each other list is as long."""
    found = items.get("name")
    if isinstance(found, list | tuple) and found and all(isinstance(n, str) and n for n in found):
        return list(found)
    return []


def _length(value: Any) -> int:
    listed = isinstance(value, list | tuple | np.ndarray) or (
        hasattr(value, "__len__") and not isinstance(value, str | bytes | dict)
    )
    return len(value) if listed else -1
