"""Logs of data loggers: MDF (asammdf), TDMS (nptdms), ULog (pyulog); channels keep their clocks."""

import sys
from collections.abc import Iterator
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.logs.draft.words import named_unit
from kemba.logs.formats import check_size
from kemba.logs.recording import (
    TIME_WORD,
    Column,
    Group,
    Raw,
    Recording,
    free,
    recording,
    shared,
    some,
)

ULOG_HEAD = 16  # bytes before the first message of a ULog, by its specification
ULOG_TYPES = b"ABCDFILMOPQRS"  # of its messages, by its specification
PIECE = 20_000  # rows of a group that are read at once


def read_mf4(path: Path) -> Recording:
    """Measurement data format, versions 3 and 4: physical values, one clock a channel group."""
    from asammdf import MDF

    check_size(path, path.stat().st_size)
    said: list[str] = []
    with MDF(path) as file:
        groups = [_mdf_group(file, number, said) for number in range(len(file.groups))]
    return _named(path, [group for group in groups if group is not None], said)


def _mdf_group(file: Any, number: int, said: list[str]) -> Group | None:
    """The channels of numbers of one group, read in pieces: asammdf needs thrice their size."""
    group = file.groups[number]
    master, stated, read = file.masters_db.get(number), int(group.channel_group.cycles_nr), 0
    rows = min(stated, _rows_there(group))
    clock = group.channels[master].name if master is not None else None
    wanted = [(None, number, i) for i in range(len(group.channels))]
    table: dict[int, Column] = {}
    time = np.empty(rows)
    for begin in range(0, rows, PIECE):
        signals = file.select(
            wanted,
            record_offset=begin,
            record_count=min(PIECE, rows - begin),
            copy_master=False,
            ignore_value2text_conversions=True,  # a valve is 0 or 1, not a text
        )
        for i, signal in enumerate(signals):
            values, invalid = signal.samples, signal.invalidation_bits
            if signal.name == clock or values.dtype.kind not in "fiub" or values.ndim > 1:
                continue
            read = begin + len(values)
            values = values if invalid is None else np.where(invalid, np.nan, values)
            table.setdefault(i, np.empty(rows, values.dtype))[begin:read] = values
            time[begin:read] = signal.timestamps
        if read < begin + PIECE:
            break  # the last piece, or a file that was cut off
    if read < stated and (table or not rows):
        said.append(f"it breaks off: {read} of {stated} readings of a group are there")
    columns: Raw = {}
    units: dict[str, str] = {}
    for i, values in table.items():
        name = free(signals[i].name, columns)
        columns[name] = values[:read]
        if signals[i].unit:
            units[name] = signals[i].unit
    return Group("", time[:read], "s", columns, units) if read else None


def _rows_there(group: Any) -> int:
    """For how many rows the data of a group suffice; of rows beyond them asammdf makes readings
    up. A group that shares its data with others may have fewer."""
    sizes = [block.original_size for block in group.get_data_blocks()]
    size = int(group.channel_group.samples_byte_nr)
    return sum(sizes) // size if size and None not in sizes else sys.maxsize


def read_tdms(path: Path) -> Recording:
    """National Instruments' TDMS: the clock of a waveform is its start, offset and increment; of
    channels without one, a channel of the group that is called a time."""
    from nptdms import TdmsFile

    groups: list[Group] = []
    said: list[str] = []
    with TdmsFile.open(path) as file:
        state = file.file_status
        if state.incomplete_final_segment or state.channel_statuses is not None:
            said.append("it breaks off: its channels end at different times")
        every = [c for group in file.groups() for c in group.channels()]
        channels = [c for c in every if len(c)]
        if empty := [c.name for c in every if not len(c)]:
            said.append(f"without any reading: {some(empty)}")
        # data under a path that is no channel's, as where a name is damaged, nptdms leaves out
        known = {channel.path for channel in every}
        objects = file._reader.object_metadata.items()
        if lost := sum(o.num_values > 0 and path not in known for path, o in objects):
            said.append(f"it is damaged: {lost} objects with data are no channels")
        check_size(path, sum(8 * len(channel) for channel in channels))
        starts = [
            c.properties["wf_start_time"] for c in channels if "wf_start_time" in c.properties
        ]
        several = len({channel.group_name for channel in channels}) > 1
        for group in file.groups():
            groups += _tdms_groups(group, min(starts, default=None), several, said)
    return _named(path, groups, said)


def _tdms_groups(group: Any, start: Any, several: bool, said: list[str]) -> Iterator[Group]:
    """The waveforms of a group, each on its clock, and its other channels on a clock of theirs."""
    path = f"{group.name}/" if several else ""
    plain: dict[str, Column] = {}
    units: dict[str, str] = {}
    for channel in group.channels():
        values = channel[:]
        if not len(values) or values.dtype.kind not in "fiubM":
            continue
        name, given = path + channel.name, channel.properties
        unit = {name: str(given["unit_string"])} if given.get("unit_string") else {}
        step = float(given.get("wf_increment", 0.0) or 0.0)
        if step <= 0.0 or values.dtype.kind == "M":
            plain[name] = values
            units |= unit
            continue
        late = float(given.get("wf_start_offset", 0.0) or 0.0)
        if start is not None and "wf_start_time" in given:
            late += float((given["wf_start_time"] - start) / np.timedelta64(1, "s"))
        yield Group("", late + step * np.arange(len(values)), "s", {name: values}, unit)
    if plain:
        yield from _plain(plain, units, group.name, said)


def _plain(plain: Raw, units: dict[str, str], name: str, said: list[str]) -> Iterator[Group]:
    """Channels without a waveform: on a channel of times, if the group has one."""
    clocks = [n for n, values in plain.items() if values.dtype.kind == "M"] or [
        n for n in plain if TIME_WORD.search(n.rpartition("/")[2])
    ]
    if not clocks:
        said.append(f"left out, since they have no times: the channels of {name}")
        return
    time = plain[clocks[0]]
    stamps = time.astype("datetime64[ns]").astype(np.int64) if time.dtype.kind == "M" else time
    named = units.get(clocks[0]) or named_unit(clocks[0])[1] or ""
    unit = "ns" if time.dtype.kind == "M" else named
    columns = {n: v for n, v in plain.items() if n != clocks[0] and len(v) == len(time)}
    if short := [n for n in plain if n != clocks[0] and n not in columns]:
        said.append(f"left out, since they are not as long as {clocks[0]}: {some(short)}")
    yield Group("", stamps, unit, columns, {n: u for n, u in units.items() if n in columns})


def read_ulg(path: Path) -> Recording:
    """PX4's ULog: a group for each message and its instance, stamps in us."""
    from pyulog import ULog

    check_size(path, path.stat().st_size)
    file = ULog(str(path))
    groups = []
    for data in file.data_list:
        name = data.name if data.multi_id == 0 else f"{data.name}/{data.multi_id}"
        columns = {
            field.replace(".", "/"): values
            for field, values in data.data.items()
            if field != "timestamp" and values.dtype.kind in "fiub"
        }
        stamps = np.asarray(data.data["timestamp"], dtype=np.int64)
        groups.append(Group(name, stamps, "us", columns))
    said = [f"{len(file.dropouts)} dropouts"] if file.dropouts else []
    if file.file_corruption or not (file.has_data_appended or _whole(path)):
        said.append("it is damaged or breaks off: what is left is read")
    return _named(path, [g for g in groups if g.columns and len(g.time) > 1], said, together=False)


def _whole(path: Path) -> bool:
    """Whether the messages of a ULog, each with its length and its type before it, are known ones
    and end where the file ends: pyulog leaves out what is not, without a word."""
    with path.open("rb") as stream, mmap(stream.fileno(), 0, access=ACCESS_READ) as data:
        at, end = ULOG_HEAD, len(data)
        while at + 3 <= end and data[at + 2] in ULOG_TYPES:
            at += 3 + data[at] + 256 * data[at + 1]
    return at == end


def _named(
    path: Path, groups: list[Group], said: list[str] | None = None, together: bool = True
) -> Recording:
    """One recording; groups of equal times are one. Raises KembaError where there are none."""
    if not groups:
        what = "holds no channel of numbers with a clock"
        raise KembaError(str(path), "; ".join([what, *(said or [])]))
    return recording(shared(groups) if together else groups, said or [])
