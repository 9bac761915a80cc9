"""How long a long log takes to read, and what it needs, beside its format's own library.

python benchmarks/reading_logs.py [--minutes 10] [--formats csv mf4 ...] [--repeats 3] [--write]

One log of 40 channels at 1 kHz is written in each format. A process of its own reads it into arrays
by the format's library, another one by kemba; the least CPU time of several repeats, that of the
processes which it starts included, and by how much it grew at most, are printed as a table, with
`--write` into the page of benchmarks.
Linux only: it tells the largest size.
"""

import argparse
import json
import struct
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pandas as pd
from block import printed, put_block

from kemba.sweep import machine

PAGE = Path(__file__).parent / "pages" / "benchmarks.md"
MARKS = "<!-- reading: written by benchmarks/reading_logs.py -->", "<!-- end of reading -->"
CHANNELS, RATE = 40, 1000
Table = dict[str, np.ndarray]

# What each library is asked for: every channel as an array. `p` is the path.
LIBRARIES = {
    "csv": ("import pandas", "f = pandas.read_csv(p); d = [f[n].to_numpy() for n in f]"),
    "parquet": (
        "import pyarrow.parquet as q",
        "f = q.read_table(p); d = [c.to_numpy() for c in f.columns]",
    ),
    "npz": ("import numpy", "f = numpy.load(p); d = [f[n] for n in f.files]"),
    "json": (
        "import json, numpy",
        "d = [numpy.array(v) for v in json.load(open(p)).values()]",
    ),
    "mat": ("import scipy.io", "d = scipy.io.loadmat(p, squeeze_me=True)"),
    "mat 7.3": (
        "import h5py",
        "f = h5py.File(p); d = [f[n][()].ravel() for n in f]",
    ),
    "mf4": (
        "import asammdf",
        "f = asammdf.MDF(p); d = [f.get(c.name).samples for c in f.groups[0].channels]",
    ),
    "tdms": (
        "import nptdms",
        "f = nptdms.TdmsFile.read(p); d = [c[:] for g in f.groups() for c in g.channels()]",
    ),
    "ulg": (
        "import pyulog",
        "f = pyulog.ULog(p); d = f.data_list[0].data",
    ),
    "lvm": (
        "import numpy",
        "d = numpy.loadtxt(p, skiprows=10)",
    ),
    "mcap": (
        "import json, numpy; from mcap.reader import make_reader",
        "m = [json.loads(x.data) for _, _, x in make_reader(open(p, 'rb')).iter_messages()]; "
        "d = [numpy.array([x[n] for x in m]) for n in m[0]]",
    ),
    "bag": (
        "import numpy; from rosbags.highlevel import AnyReader; from pathlib import Path",
        "r = AnyReader([Path(p)]); r.open()\n"
        "m = [r.deserialize(raw, c.msgtype).data for c, _, raw in r.messages()]\n"
        "d = numpy.array(m)",
    ),
    "sto": (
        "import numpy",
        "d = numpy.loadtxt(p, skiprows=5)",
    ),
}
KEMBA = (
    "from kemba.logs.foreign import raw_columns; from kemba.logs.draft.draft import layout_of; "
    "from kemba.logs import ColumnMap; from pathlib import Path; import pandas; "
    "from kemba.logs.formats import reader; reader(Path(p)) if {binary} else None",
    "d = raw_columns(Path(p), ColumnMap.model_construct())",
)
MEASURE = """
import gc, os, resource
p = {path!r}
{load}
gc.collect()
def size(key):
    lines = open("/proc/self/status").read().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(key))
open("/proc/self/clear_refs", "w").write("5")  # the largest size is counted from here
before = size("VmRSS")
start = sum(os.times()[:4])
{read}
other = 1024 * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss  # of a process that it asks
print(sum(os.times()[:4]) - start, max(size("VmHWM") - before, other))
"""


def table(minutes: float) -> Table:
    """The log: its time and the channels, as sensors with six digits have them."""
    n = int(60 * minutes * RATE)
    rng = np.random.default_rng(0)
    channels = {f"sensor_{i}": np.round(rng.standard_normal(n), 6) for i in range(CHANNELS)}
    return {"time": np.arange(n) / RATE, **channels}


def _csv(log: Table, path: Path) -> None:
    pd.DataFrame(log).to_csv(path, index=False)


def _parquet(log: Table, path: Path) -> None:
    pd.DataFrame(log).to_parquet(path)


def _npz(log: Table, path: Path) -> None:
    np.savez(path, **log)  # type: ignore[arg-type]


def _json(log: Table, path: Path) -> None:
    path.write_text(json.dumps({name: values.tolist() for name, values in log.items()}))


def _mat(log: Table, path: Path) -> None:
    from scipy.io import savemat

    savemat(path, log)


def _mat73(log: Table, path: Path) -> None:
    """HDF5 behind the header of MATLAB 7.3, as MATLAB writes vectors."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in log.items():
            data = file.create_dataset(name, data=values[None, :])
            data.attrs["MATLAB_class"] = np.bytes_("double")
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    with path.open("r+b") as stream:
        stream.write(head)


def _mf4(log: Table, path: Path) -> None:
    import asammdf

    signals = [asammdf.Signal(v, log["time"], name=n) for n, v in log.items() if n != "time"]
    with asammdf.MDF() as file:
        file.append(signals)
        file.save(path, overwrite=True)


def _tdms(log: Table, path: Path) -> None:
    import nptdms

    wave = {"wf_increment": 1 / RATE, "wf_start_offset": 0.0}
    channels = [
        nptdms.ChannelObject("log", n, v, properties=wave) for n, v in log.items() if n != "time"
    ]
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(channels)


def _ulg(log: Table, path: Path) -> None:
    """By its specification: pyulog writes no arrays."""
    names = [name for name in log if name != "time"]
    fields = ";".join(["uint64_t timestamp", *(f"double {name}" for name in names)]) + ";"
    texts = {"F": f"log:{fields}".encode(), "A": struct.pack("<BH", 0, 0) + b"log"}
    head = b"\x55\x4c\x6f\x67\x01\x12\x35\x01" + struct.pack("<Q", 0)
    for kind, data in texts.items():
        head += struct.pack("<HB", len(data), ord(kind)) + data
    kind = np.dtype(
        [
            ("size", "<u2"),
            ("kind", "u1"),
            ("number", "<u2"),
            ("t", "<u8"),
            *((n, "<f8") for n in names),
        ]
    )
    rows = np.zeros(len(log["time"]), kind)
    rows["size"], rows["kind"] = kind.itemsize - 3, ord("D")
    rows["t"] = np.round(1e6 * log["time"])
    for name in names:
        rows[name] = log[name]
    path.write_bytes(head + rows.tobytes())


def _lvm(log: Table, path: Path) -> None:
    names = [name for name in log if name != "time"]
    head = [
        "LabVIEW Measurement", "Writer_Version\t2", "Separator\tTab", "Decimal_Separator\t.",
        "***End_of_Header***", "", f"Channels\t{len(names)}", "Samples\t1",
        "***End_of_Header***", "\t".join(["X_Value", *names]),
    ]  # fmt: skip
    text = "\n".join(head)
    np.savetxt(path, np.column_stack(list(log.values())), "%.6f", "\t", header=text, comments="")


def _mcap(log: Table, path: Path) -> None:
    from mcap.writer import Writer

    names, rows = list(log), np.column_stack(list(log.values())).tolist()
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel("/log", "json", 0)
        for row in rows:
            stamp = round(1e9 * row[0])
            data = json.dumps(dict(zip(names, row, strict=True))).encode()
            writer.add_message(channel, stamp, data, stamp)
        writer.finish()


def _bag(log: Table, path: Path) -> None:
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kind = "std_msgs/msg/Float64MultiArray"
    array, layout = store.types[kind], store.types["std_msgs/msg/MultiArrayLayout"]
    rows = np.column_stack(list(log.values()))
    with Writer(path, version=9) as writer:
        connection = writer.add_connection("/log", kind, typestore=store)
        for row in rows:
            message = array(layout=layout(dim=[], data_offset=0), data=row)
            writer.write(connection, round(1e9 * row[0]), store.serialize_cdr(message, kind))


def _sto(log: Table, path: Path) -> None:
    head = f"log\nversion=1\nnRows={len(log['time'])}\nendheader\n" + "\t".join(log)
    np.savetxt(path, np.column_stack(list(log.values())), "%.6f", "\t", header=head, comments="")


WRITERS: dict[str, Callable[[Table, Path], None]] = {
    "csv": _csv, "parquet": _parquet, "npz": _npz, "json": _json, "mat": _mat,
    "mat 7.3": _mat73, "mf4": _mf4, "tdms": _tdms, "mcap": _mcap, "bag": _bag, "sto": _sto,
    "ulg": _ulg, "lvm": _lvm,
}  # fmt: skip
FILES = {"bag": "log_bag", "mat 7.3": "log73.mat"}  # others: log.ENDING


def measured(path: Path, load: str, read: str, repeats: int) -> tuple[float, float]:
    """The least CPU time [s], and the least growth of the process [bytes]."""
    script = MEASURE.format(path=str(path), load=load, read=read)
    found = []
    for _ in range(repeats):
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(done.stderr)
        found.append(tuple(map(float, done.stdout.split()[-2:])))
    times, sizes = zip(*found, strict=True)
    return min(times), min(sizes)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--formats", nargs="+", choices=WRITERS, default=list(WRITERS))
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--write", action="store_true", help="put the table into the page")
    asked = parser.parse_args()
    lines = printed(rows(asked.minutes, asked.formats, asked.repeats))
    if asked.write:
        how = f"The least of {asked.repeats} times each, on {machine()}."
        put_block(PAGE, *MARKS, [*lines, "", how])


def rows(minutes: float, formats: list[str], repeats: int) -> Iterator[str]:
    """Lines of the table, one format after the other."""
    log = table(minutes)
    arrays = sum(values.nbytes for values in log.values())
    size = f"arrays of {arrays / 1e6:.0f} MB"
    yield f"{minutes:g} min, {CHANNELS} channels at {RATE} Hz: {size}"
    yield ""
    yield "| format | library, s CPU | kemba, s CPU | times | library, MB | kemba, MB | arrays |"
    yield "|---|---:|---:|---:|---:|---:|---:|"
    with tempfile.TemporaryDirectory() as folder:
        for ending in formats:
            path = Path(folder) / FILES.get(ending, f"log.{ending}")
            WRITERS[ending](log, path)
            load, read = LIBRARIES[ending]
            theirs = measured(path, load, read, repeats)
            load, read = KEMBA
            ours = measured(path, load.format(binary=ending != "csv"), read, repeats)
            yield (
                f"| {ending} | {theirs[0]:.2f} | {ours[0]:.2f} | {ours[0] / theirs[0]:.2f} | "
                f"{theirs[1] / 1e6:.0f} | {ours[1] / 1e6:.0f} | {ours[1] / arrays:.2f} |"
            )
            if path.is_file():
                path.unlink()


if __name__ == "__main__":
    main()
