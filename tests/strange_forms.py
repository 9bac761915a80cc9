"""A table of columns in the file formats of other programs, with one rate or two."""

import json
import re
import struct
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.io import savemat

START = 1_766_147_454_200_000_000  # ns since 1970
EVERY = 10  # rows of the fast channels to one of the slow ones
Columns = dict[str, np.ndarray]


@dataclass
class Table:
    """Columns, units `below` their names, names of the clock's columns and of those that may be
    `slow`; `time` [s] of the rows, for formats with a clock of their own; angles in `degrees`."""

    columns: Columns
    time: np.ndarray
    clock: set[str]
    slow: set[str]
    degrees: bool = False
    below: dict[str, str] = field(default_factory=dict)

    @property
    def wide(self) -> set[str]:
        """Channels that reach a thousand."""
        numbers = {n: v for n, v in self.numbers().items() if n not in self.clock}
        return {n for n, v in numbers.items() if np.abs(v).max(initial=0.0) >= 1e3}

    def labelled(self) -> Columns:
        """Units in a row of their own go behind the names, where a format has no such row."""
        below = self.below
        return {f"{n} [{below[n]}]" if n in below else n: v for n, v in self.columns.items()}

    def numbers(self, labelled: bool = False) -> Columns:
        """The columns that hold numbers."""
        columns = self.labelled() if labelled else self.columns
        return {n: v for n, v in columns.items() if v.dtype.kind in "fi"}

    def channels(self) -> Columns:
        """The same without the clock, by names that programming languages allow."""
        numbers = {n: v for n, v in self.numbers().items() if n not in self.clock}
        return {_plain(n): v.astype(float) for n, v in numbers.items()}

    def rates(self) -> list[tuple[str, Columns, slice]]:
        """Topics of those, the slow ones apart, and which rows each has."""
        slow = {_plain(n) for n in self.slow}
        parts = [
            {n: v for n, v in self.channels().items() if (n in slow) is way}
            for way in (True, False)
        ]
        steps = slice(None, None, EVERY), slice(None)
        found = zip(("mocap", "legs"), parts, steps, strict=True)
        return [part for part in found if part[1]]


def _plain(name: str) -> str:
    found = re.sub(r"\W+", "_", name).strip("_")
    return found if found[0].isalpha() else f"c_{found}"


Writer = Callable[[Table, Path], Path]


def _text(
    separator: str, decimal: str, ending: str, encoding: str = "utf-8", head: str = ""
) -> Writer:
    def write(table: Table, path: Path) -> Path:
        frame = pd.DataFrame(table.columns)
        lines = frame.to_csv(index=False, sep=separator, decimal=decimal).split("\n")
        if table.below:
            lines.insert(1, separator.join(table.below.get(name, "") for name in table.columns))
        path = path.with_suffix(ending)
        path.write_text(head + "\n".join(lines), encoding=encoding)
        return path

    return write


def _topic_per_row(table: Table, path: Path) -> Path:
    """Slow columns and others in rows of their own."""
    first, second = pd.DataFrame(table.columns), pd.DataFrame(table.columns)
    others = [n for n in table.numbers() if n not in table.slow | table.clock]
    first[others], second[list(table.slow)] = np.nan, np.nan
    rows = pd.concat([first, second]).sort_index(kind="stable")
    columns = {n: rows[n].to_numpy() for n in rows}
    return _text(",", ".", ".csv")(
        Table(columns, table.time, set(), set(), below=table.below), path
    )


def _thousands(separator: str, decimal: str, mark: str) -> Writer:
    """Numbers of three decimals with parted thousands."""

    def write(table: Table, path: Path) -> Path:
        trade = str.maketrans({",": mark, ".": decimal})
        large = {n: v for n, v in table.columns.items() if v.dtype.kind == "f" and n in table.wide}
        cells = {n: [f"{x:,.3f}".translate(trade) for x in v] for n, v in large.items()}
        columns = {n: np.array(cells.get(n, v), dtype=cells.get(n) and object)
                   for n, v in table.columns.items()}  # fmt: skip
        return _text(separator, decimal, ".csv")(replace(table, columns=columns), path)

    return write


def _remarks_between(table: Table, path: Path) -> Path:
    """A remark and the header again between the rows, a line below them."""
    path = _text(",", ".", ".csv")(table, path)
    lines = path.read_text(encoding="utf-8").rstrip("\n").split("\n")
    lines[300:300] = ["# trigger, by hand", lines[0]]
    path.write_text("\n".join([*lines, "", "End of file", "\0" * 64]), encoding="utf-8")
    return path


def _merged(table: Table, path: Path) -> Path:
    """Names in two rows; the upper one names the first column of each group alone."""
    path = _text(";", ",", ".csv")(table, path)
    first, *lines = path.read_text(encoding="utf-8").split("\n")
    parts = [name.rpartition("_") for name in first.split(";")]
    upper = [
        head if i == 0 or head != parts[i - 1][0] else "" for i, (head, _, _) in enumerate(parts)
    ]
    if not all(head for head, _, _ in parts):  # what has no group would get the one before it
        return path
    lower = [last for _, _, last in parts]
    path.write_text("\n".join([";".join(upper), ";".join(lower), *lines]), encoding="utf-8")
    return path


def _long(ending: str) -> Writer:
    """One row for each time, channel and reading; slow channels in a tenth of them."""

    def write(table: Table, path: Path) -> Path:
        path = path.with_suffix(ending)
        numbers = {n: v for n, v in table.labelled().items() if v.dtype.kind in "fi"}
        labelled = [
            n for n in numbers if n.split(" [")[0] not in table.clock and n not in table.clock
        ]
        parts = []
        for name in labelled:
            rows = slice(None, None, EVERY if name in table.slow else 1)
            parts.append(
                pd.DataFrame({"time": table.time[rows], "name": name, "value": numbers[name][rows]})
            )
        frame = pd.concat(parts).sort_values("time", kind="stable")
        if ending == ".parquet":
            frame.to_parquet(path)
        else:
            frame.to_csv(path, index=False)
        return path

    return write


def _parquet(table: Table, path: Path) -> Path:
    path = path.with_suffix(".parquet")
    pd.DataFrame(table.labelled()).to_parquet(path)
    return path


def _npz(table: Table, path: Path) -> Path:
    path = path.with_suffix(".npz")
    np.savez(path, **{n: v.astype(str) if v.dtype == object else v
                      for n, v in table.labelled().items()})  # fmt: skip
    return path


def _json(table: Table, path: Path) -> Path:
    path = path.with_suffix(".json")
    path.write_text(json.dumps({n: v.tolist() for n, v in table.labelled().items()}))
    return path


def _with_time(table: Table) -> Columns:
    """Channels with a time in seconds, for formats that hold numbers under plain names."""
    return {"time": table.time, **table.channels()}


def _mat(table: Table, path: Path) -> Path:
    """A matrix and the names of its columns, as a struct: MATLAB has no such names itself."""
    path, numbers = path.with_suffix(".mat"), table.numbers(labelled=True)
    if not table.clock & set(table.numbers()):
        numbers = {"time": table.time, **numbers}
    data = np.column_stack([v.astype(float) for v in numbers.values()])
    savemat(path, {"log": {"data": data, "names": np.array(list(numbers), dtype=object)}})
    return path


def _vectors(table: Table, path: Path) -> Path:
    path = path.with_suffix(".mat")
    savemat(path, {n: v[:, None] for n, v in _with_time(table).items()}, long_field_names=True)
    return path


def _mat73(table: Table, path: Path) -> Path:
    """MATLAB 7.3: vectors in HDF5, as columns."""
    import h5py

    path = path.with_suffix(".mat")
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in _with_time(table).items():
            data = file.create_dataset(name, data=values[None, :])
            data.attrs["MATLAB_class"] = np.bytes_("double")
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    with path.open("r+b") as stream:
        stream.write(head)
    return path


def _mcap(table: Table, path: Path) -> Path:
    """One topic of all columns, text too."""
    columns = {n: v.tolist() for n, v in table.labelled().items()}
    rows = [{n: v[i] for n, v in columns.items()} for i in range(len(table.time))]
    return _messages([("/log", rows, slice(None))], table, path)


def _topics(table: Table, path: Path) -> Path:
    """Two topics at their own rates."""
    topics = []
    for name, part, rows in table.rates():
        values = {n: v.tolist() for n, v in part.items()}
        every = range(len(table.time))[rows]
        topics.append((f"/{name}", [{n: v[i] for n, v in values.items()} for i in every], rows))
    return _messages(topics, table, path)


def _messages(topics: list[tuple[str, list[dict], slice]], table: Table, path: Path) -> Path:
    from mcap.writer import Writer

    path = path.with_suffix(".mcap")
    stamps = START + np.round(1e9 * table.time).astype(np.int64)
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        for topic, messages, rows in topics:
            channel = writer.register_channel(topic, "json", 0)
            for message, stamp in zip(messages, stamps[rows].tolist(), strict=True):
                writer.add_message(channel, stamp, json.dumps(message).encode(), stamp)
        writer.finish()
    return path


def _bag(table: Table, path: Path) -> Path:
    """rosbag2: a topic of one number for each channel, slow ones at their own rate."""
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    path, store = path.with_name(f"{path.name}_bag"), get_typestore(Stores.ROS2_HUMBLE)
    kind = "std_msgs/msg/Float64"
    stamps = START + np.round(1e9 * table.time).astype(np.int64)
    with Writer(path, version=9) as writer:
        for _, part, rows in table.rates():
            for name, values in part.items():
                topic = writer.add_connection(f"/{name}", kind, typestore=store)
                for value, stamp in zip(values[rows], stamps[rows].tolist(), strict=True):
                    message = store.types[kind](data=float(value))
                    writer.write(topic, stamp, store.serialize_cdr(message, kind))
    return path


def _tdms(table: Table, path: Path) -> Path:
    from nptdms import ChannelObject, TdmsWriter

    path = path.with_suffix(".tdms")
    wave = {"wf_increment": 1e-3, "wf_start_offset": 0.0}
    units = {name: {"unit_string": unit} for name, unit in table.below.items()}
    channels = [
        ChannelObject("log", n, v, wave | units.get(n, {})) for n, v in table.numbers().items()
    ]
    with TdmsWriter(path) as writer:
        writer.write_segment(channels)
    return path


def _tdms_rates(table: Table, path: Path) -> Path:
    from nptdms import ChannelObject, TdmsWriter

    path, channels = path.with_suffix(".tdms"), []
    for name, part, rows in table.rates():
        wave = {"wf_increment": 1e-3 * (rows.step or 1), "wf_start_offset": 0.0}
        channels += [ChannelObject(name, n, v[rows], wave) for n, v in part.items()]
    with TdmsWriter(path) as writer:
        writer.write_segment(channels)
    return path


def _mf4(table: Table, path: Path) -> Path:
    parts = [("log", table.numbers(), slice(None))]
    return _mdf(parts, table, path, 1e-3 * np.arange(len(table.time)))


def _mf4_rates(table: Table, path: Path) -> Path:
    return _mdf(table.rates(), table, path, table.time)


def _mdf(
    parts: list[tuple[str, Columns, slice]], table: Table, path: Path, time: np.ndarray
) -> Path:
    from asammdf import MDF, Signal

    path = path.with_suffix(".mf4")
    with MDF() as file:
        for _, part, rows in parts:
            file.append(
                [Signal(v[rows], time[rows], table.below.get(n, ""), n) for n, v in part.items()]
            )
        file.save(path, overwrite=True)
    return path


def _ulg(table: Table, path: Path) -> Path:
    """PX4's log as its specification says: a message for each rate."""
    blocks = [b"\x55\x4c\x6f\x67\x01\x12\x35\x01" + struct.pack("<Q", 0)]
    parts = table.rates()
    for name, part, _ in parts:
        fields = ";".join(["uint64_t timestamp", *(f"double {n}" for n in part)]) + ";"
        blocks.append(_message("F", f"{name}:{fields}".encode()))
    for number, (name, _, _) in enumerate(parts):
        blocks.append(_message("A", struct.pack("<BH", 0, number) + name.encode()))
    for row, time in enumerate(table.time):
        for number, (_, part, rows) in enumerate(parts):
            if row % (rows.step or 1) == 0:
                stamp = round(1e6 * time) + 5_000_000
                data = struct.pack(
                    f"<HQ{len(part)}d", number, stamp, *(v[row] for v in part.values())
                )
                blocks.append(_message("D", data))
    path = path.with_suffix(".ulg")
    path.write_bytes(b"".join(blocks))
    return path


def _message(kind: str, data: bytes) -> bytes:
    return struct.pack("<HB", len(data), ord(kind)) + data


def _lvm(decimal: str, with_time: bool) -> Writer:
    """LabVIEW with a column of the time, or its start and increment."""

    def write(table: Table, path: Path) -> Path:
        numbers = {n: v for n, v in table.numbers().items() if n not in table.clock}
        units = "\t".join(["Y_Unit_Label", *(table.below.get(n, "") for n in numbers)])
        count = "\t".join
        head = ["LabVIEW Measurement", "Writer_Version\t2", "Separator\tTab",
                f"Decimal_Separator\t{decimal}", f"X_Columns\t{'One' if with_time else 'No'}",
                "***End_of_Header***", "", f"Channels\t{len(numbers)}", units,
                count(["X0", *["0.0".replace(".", decimal)] * len(numbers)]),
                count(["Delta_X", *["0.001".replace(".", decimal)] * len(numbers)]),
                "***End_of_Header***",
                "\t".join([*(["X_Value"] * with_time), *numbers, "Comment"])]  # fmt: skip
        cells = [*([table.time] * with_time), *numbers.values()]
        rows = [
            "\t".join(f"{c:.9g}".replace(".", decimal) for c in row) + "\t"
            for row in np.column_stack(cells)
        ]
        path = path.with_suffix(".lvm")
        path.write_text("\n".join([*head, *rows]) + "\n")
        return path

    return write


def _sto(table: Table, path: Path) -> Path:
    """OpenSim: SI units, names without blanks."""
    path, columns = path.with_suffix(".sto"), _with_time(table)
    degrees = "yes" if table.degrees else "no"
    size = f"nRows={len(table.time)}\nnColumns={len(columns)}\ninDegrees={degrees}"
    head = f"log\nversion=1\n{size}\nendheader\n" + "\t".join(columns)
    np.savetxt(
        path, np.column_stack(list(columns.values())), "%.9g", "\t", header=head, comments=""
    )
    return path


FORMS: dict[str, Writer] = {
    "comma": _text(",", ".", ".csv"),
    "semicolon": _text(";", ",", ".csv"),
    "tab": _text("\t", ".", ".tsv"),
    "remarks": _text(",", ".", ".csv", head="# export of run 7\n# 19.12.2025\n\n"),
    "marked": _text(";", ".", ".csv", "utf-8-sig"),
    "unicode": _text("\t", ",", ".txt", "utf-16"),
    "topic per row": _topic_per_row,
    "remarks between": _remarks_between,
    "merged header": _merged,
    "thousands": _thousands(";", ".", ","),
    "thousands comma": _thousands(";", ",", "."),
    "long": _long(".csv"),
    "long parquet": _long(".parquet"),
    "parquet": _parquet,
    "npz": _npz,
    "json": _json,
    "mat": _mat,
    "mat vectors": _vectors,
    "mat 7.3": _mat73,
    "mcap": _mcap,
    "mcap rates": _topics,
    "bag rates": _bag,
    "tdms": _tdms,
    "tdms rates": _tdms_rates,
    "mf4": _mf4,
    "mf4 rates": _mf4_rates,
    "ulg rates": _ulg,
    "lvm": _lvm(".", True),
    "lvm comma": _lvm(",", False),
    "sto": _sto,
}
# forms with a clock of their own, names of letters and no units: these stand in the names
BARE = ("mat vectors", "mat 7.3", "mcap rates", "bag rates", "tdms rates", "mf4 rates", "ulg rates",
        "sto")  # fmt: skip
