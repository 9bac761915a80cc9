"""Logs in other formats, damaged: bytes that are cut, changed or repeated, and whole files with odd
content. A file is a text of its ending, a colon, and its bytes as Latin-1."""

import io
import json
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st

from fuzz import sound
from fuzz.values import anything
from kemba.report.export import export
from kemba.trajectory import Trajectory

ENDINGS = ("npz", "mat", "json", "parquet", "mcap")
ROWS = 600
Draw = Callable[[st.SearchStrategy[Any]], Any]


def as_text(ending: str, content: bytes) -> str:
    return f"{ending}:{content.decode('latin-1')}"


def as_file(text: str, folder: Path) -> Path:
    """The file of such a text."""
    ending, _, content = text.partition(":")
    file = folder / f"input.{ending}"
    file.write_bytes(content.encode("latin-1"))
    return file


@cache
def whole(ending: str) -> bytes:
    """A sound bench log in this format."""
    log = sound.bench()
    columns = {h: log[n][:ROWS] for h, n in zip(log.headers, log.names, strict=True)}
    with tempfile.TemporaryDirectory() as folder:
        short = Trajectory(log.time[:ROWS], columns, log.meta)
        return export(short, Path(folder) / f"log.{ending}").read_bytes()


def damage(draw: Draw, content: bytes) -> bytes:
    """One to three kinds of damage to the bytes."""
    found = bytearray(content)
    for kind in draw(st.lists(st.sampled_from(("cut", "flip", "zero", "repeat", "other")),
                              min_size=1, max_size=3)):  # fmt: skip
        at = draw(st.integers(0, max(len(found) - 1, 0)))
        if kind == "cut":
            del found[at:]
        elif kind == "flip" and found:
            found[at] ^= draw(st.integers(1, 255))
        elif kind == "zero":
            found[at : at + 16] = bytes(min(16, len(found) - at))
        elif kind == "repeat":
            found[at:at] = found[at : at + draw(st.integers(1, 64))]
        elif kind == "other":
            found[at : at + 8] = draw(st.binary(min_size=8, max_size=8))
    return bytes(found)


@st.composite
def damaged_bytes(draw: Draw, endings: tuple[str, ...] = ENDINGS) -> str:
    """Damage to the bytes of a log in one of these formats of ours."""
    ending = draw(st.sampled_from(endings))
    return as_text(ending, damage(draw, whole(ending)))


ARRAYS: tuple[Any, ...] = (
    np.zeros(0), np.zeros(3), np.float64(1.0), np.zeros((ROWS, 2)), np.zeros((ROWS, 1)),
    np.full(ROWS, np.inf), np.full(ROWS, np.nan), np.zeros(ROWS, bool), np.zeros(ROWS, complex),
    np.array(["a"] * ROWS), np.array("text"), np.full(ROWS, 2**63, np.uint64),
    np.zeros(ROWS, "datetime64[ns]"), np.arange(ROWS)[::-1], np.full(ROWS, 1e308),
)  # fmt: skip
HEADERS = ("time", "units", "meta", "headers", "time [s]", "piston/x", "piston/F [N]", "x [m]", "")


@cache
def _arrays() -> dict[str, Any]:
    with np.load(io.BytesIO(whole("npz"))) as file:
        return {name: file[name] for name in file.files}


@st.composite
def odd_npz(draw: Draw) -> str:
    """Named arrays of any kind where kemba writes its own."""
    content = dict(_arrays())
    for name in draw(st.lists(st.sampled_from((*content, *HEADERS)), min_size=1, max_size=3)):
        if draw(st.booleans()):
            content.pop(name, None)
        elif name:
            content[name] = draw(st.sampled_from(ARRAYS))
    stream = io.BytesIO()
    np.savez(stream, **content)
    return as_text("npz", stream.getvalue())


@st.composite
def odd_mat(draw: Draw) -> str:
    """The same of a MATLAB file."""
    from scipy.io import loadmat, savemat

    known = loadmat(io.BytesIO(whole("mat")), squeeze_me=True)
    content = {k: v for k, v in known.items() if not k.startswith("__")}
    for name in draw(st.lists(st.sampled_from(tuple(content)), min_size=1, max_size=3)):
        if draw(st.booleans()):
            content.pop(name, None)
        else:
            usable = [a for a in ARRAYS if np.asarray(a).dtype.kind != "M"]
            content[name] = draw(st.sampled_from(usable))
    stream = io.BytesIO()
    savemat(stream, content, long_field_names=True)
    return as_text("mat", stream.getvalue())


@st.composite
def odd_json(draw: Draw) -> str:
    """JSON with anything in the place of a column, of the columns or of the metadata."""
    content = json.loads(whole("json"))
    values = st.one_of(anything, st.sampled_from([10**400, [[1, 2]], [{}], ["a"] * ROWS]))
    for place in draw(st.lists(st.sampled_from(("column", "columns", "meta", "kind", "all")),
                               min_size=1, max_size=2)):  # fmt: skip
        if place == "all" or not isinstance(content, dict):
            content = draw(values)
        elif place == "column" and isinstance(content.get("columns"), dict):
            content["columns"][draw(st.sampled_from((*content["columns"], *HEADERS)))] = draw(
                values
            )
        elif place == "kind":
            content["meta"] = {draw(st.sampled_from(("kind", "noise", "name"))): draw(values)}
        else:
            content[place] = draw(values)
    return as_text("json", json.dumps(content).encode())


@st.composite
def odd_parquet(draw: Draw) -> str:
    """Columns and metadata of other types."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pq.read_table(io.BytesIO(whole("parquet")))
    columns = {name: table.column(name) for name in table.column_names}
    odd = [
        pa.nulls(ROWS), pa.array(["a"] * ROWS), pa.array([[1]] * ROWS), pa.array([{"a": 1}] * ROWS),
        pa.array([None, *range(1, ROWS)]), pa.array([True] * ROWS), pa.array([b"\xff"] * ROWS),
        pa.array([float("inf")] * ROWS), pa.array([0] * ROWS, pa.timestamp("ns")),
        pa.array([2**62] * ROWS), pa.array([0] * ROWS, pa.duration("us")),
    ]  # fmt: skip
    for name in draw(st.lists(st.sampled_from((*columns, *HEADERS)), max_size=3)):
        columns[name] = draw(st.sampled_from(odd))
    meta = draw(st.sampled_from([b"{}", b"[]", b"null", b"{", b"\xff", b'{"kind": 1}', b""]))
    stream = io.BytesIO()
    pq.write_table(pa.table(columns).replace_schema_metadata({b"kemba": meta}), stream)
    return as_text("parquet", stream.getvalue())


MESSAGES = (b"{}", b"[]", b"1", b"null", b'"a"', b"{", b"\xff", b'{"time": "a"}', b'{"time": null}',
            b'{"time": 0, "x": [1, {"y": 2}]}', b'{"time": 0, "x": "a"}', b'{"x": 1e999}',
            b'{"time": 0, "x": ' + b"1" * 400 + b"}", b"[" * 5000)  # fmt: skip
NOTES: tuple[dict[str, str], ...] = (
    {}, {"headers": "[]"}, {"headers": "["}, {"headers": "1", "meta": "{}"},
    {"headers": '["piston/x [m]"]', "meta": "[]"}, {"headers": '["x [m]", 1]', "meta": "null"},
    {"headers": '["piston/x [m]"]'}, {"headers": '["x"]', "meta": '{"kind": []}'},
)  # fmt: skip


@st.composite
def odd_mcap(draw: Draw) -> str:
    """Messages that are no numbers, and notes that are not kemba's."""
    from mcap.writer import Writer

    stream = io.BytesIO()
    writer = Writer(stream)
    writer.start()
    for topic in draw(st.lists(st.sampled_from(("/piston", "/", "", "/a/b")), max_size=2)):
        channel = writer.register_channel(topic, draw(st.sampled_from(("json", "cdr"))), 0)
        for stamp in draw(st.lists(st.integers(0, 2**63), max_size=4)):
            writer.add_message(channel, stamp, draw(st.sampled_from(MESSAGES)), stamp)
    if draw(st.booleans()):
        writer.add_metadata("kemba", draw(st.sampled_from(NOTES)))
    writer.finish()
    return as_text("mcap", stream.getvalue())


ODD = {"npz": odd_npz, "mat": odd_mat, "json": odd_json, "parquet": odd_parquet, "mcap": odd_mcap}


def odd_formats() -> st.SearchStrategy[str]:
    """A damaged log in any format but text."""
    return st.one_of(damaged_bytes(), *(odd() for odd in ODD.values()))


def odd_format(ending: str) -> st.SearchStrategy[str]:
    """A damaged log in this format of ours: its bytes, or its content."""
    return st.one_of(damaged_bytes((ending,)), ODD[ending]())
