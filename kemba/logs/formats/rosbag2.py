"""Bags of ROS 2: a folder with its files, or one SQLite file of them."""

import sqlite3
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from kemba.errors import KembaError
from kemba.logs.formats import check_size, missing
from kemba.logs.formats.mcap import Decode, Topic, cdr_of_store, decoder, read_mcap
from kemba.logs.recording import Recording, recording

WAY_OUT = "ros2 bag convert writes it without, or as MCAP"


def read_db3(path: Path) -> Recording:
    """Every number of a bag as a column `topic/field`, each topic on its own clock. Raises
    KembaError where nothing in it is read."""
    files = [path]
    if path.is_dir():
        files = sorted(p for p in path.iterdir() if p.suffix in (".db3", ".mcap"))
        if not files:
            packed = any(p.suffix == ".zstd" for p in path.iterdir())
            what = "is a compressed bag" if packed else "is a bag without a .db3 or .mcap file"
            raise KembaError(str(path), what, "a bag of plain files was expected", WAY_OUT)
        if files[0].suffix == ".mcap":
            found = [read_mcap(file) for file in files if file.suffix == ".mcap"]
            more = () if len(found) == 1 else (f"only {files[0].name} of {len(found)} is read",)
            return replace(found[0], remarks=(*found[0].remarks, *more))
    topics: dict[str, Topic] = {}
    said: list[str] = []
    for file in files:
        check_size(file, file.stat().st_size)
        try:
            _take(file, topics, said)
        except ImportError as error:
            raise missing(path, error) from None
        except sqlite3.Error as error:
            raise KembaError(str(file), f"is no bag: {error}") from None
    if not any(topic.columns for topic in topics.values()):
        what = "; ".join(said) or "it has no messages"
        raise KembaError(str(path), f"has no message that kemba reads: {what}")
    groups = [topic.group(said) for topic in topics.values() if topic.columns]
    return recording(groups, said)


def _take(file: Path, topics: dict[str, Topic], said: list[str]) -> None:
    address = f"file:{file.resolve().as_posix()}?mode=ro&immutable=1"
    with closing(sqlite3.connect(address, uri=True)) as base:
        schemas = _schemas(base)
        known: dict[int, Topic | None] = {}
        lost = 0
        query = "SELECT id, name, type, serialization_format FROM topics"
        for number, name, kind, encoding in base.execute(query):
            decode = _decode(encoding, kind, schemas)
            if decode is None:
                said.append(f"topic {name} is not read: its messages are {encoding} of {kind}")
                known[number] = None
                continue
            known[number] = topics.setdefault(name, Topic(name, decode))
        query = "SELECT topic_id, timestamp, data FROM messages"
        for number, stamp, data in base.execute(query):
            if (topic := known.get(number)) is not None:
                topic.add(stamp, topic.decode(data))
            lost += number not in known
        if lost:
            said.append(f"it is damaged: {lost} messages are of topics that it does not list")


def _schemas(base: sqlite3.Connection) -> dict[str, tuple[str, str]]:
    """Definitions by type, which newer bags hold."""
    try:
        query = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
        return {kind: (encoding, text) for kind, encoding, text in base.execute(query)}
    except sqlite3.Error:
        return {}


def _decode(encoding: str, kind: str, schemas: dict[str, tuple[str, str]]) -> Decode | None:
    if encoding != "cdr":
        return None
    if kind in schemas and schemas[kind][1]:
        form, text = schemas[kind]
        schema: Any = SimpleNamespace(name=kind, encoding=form, data=text.encode())
        return decoder("cdr", schema)
    return cdr_of_store(kind)
