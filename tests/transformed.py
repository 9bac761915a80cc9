"""Logs written in another way that says the same: units, order, clock, rate, side, pieces."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np

from kemba.config import dump_yaml
from kemba.identify.logs.reading import read_log
from kemba.trajectory import Trajectory

Logs = Sequence[Trajectory]
Change = Callable[[Logs], list[Trajectory]]


def _rows(log: Trajectory, chosen: np.ndarray, name: str = "") -> Trajectory:
    columns = {h: log[n][chosen] for h, n in zip(log.headers, log.names, strict=True)}
    meta = {**log.meta, "name": name or log.meta["name"]}
    return Trajectory(log.time[chosen], columns, meta)


def permuted(logs: Logs) -> list[Trajectory]:
    """Columns in reversed order."""
    return [log.select(reversed(log.names)) for log in logs]


def later(logs: Logs) -> list[Trajectory]:
    """Another zero of the time, for each log its own."""
    return [
        Trajectory(
            log.time + 1000.0 * (i + 1),
            {h: log[n] for h, n in zip(log.headers, log.names, strict=True)},
            log.meta,
        )
        for i, log in enumerate(logs)
    ]


def halved(logs: Logs) -> list[Trajectory]:
    """Every log as two."""
    out = []
    for log in logs:
        rows, middle = np.arange(len(log)), len(log) // 2
        out += [_rows(log, rows < middle, f"{log.meta['name']}-1")]
        out += [_rows(log, rows >= middle, f"{log.meta['name']}-2")]
    return out


def coarser(logs: Logs) -> list[Trajectory]:
    """Half the rate."""
    return [_rows(log, np.arange(len(log)) % 2 == 0) for log in logs]


def noisier(logs: Logs) -> list[Trajectory]:
    """Noise of half the sensors' size on top, drawn anew."""
    rng = np.random.default_rng(99)
    out = []
    for log in logs:
        sizes = {"piston/F": 0.5, "piston/x": 1.5e-5}
        noise = {n: s * rng.standard_normal(len(log)) for n, s in sizes.items() if n in log}
        out.append(log.with_columns({f"{n} [{log.unit(n)}]": log[n] + e for n, e in noise.items()}))
    return out


MIRRORED = ("body/x", "body/pitch", "hip/q", "hip/tau")
OTHER = {"front": "rear", "rear": "front"}


def mirrored(logs: Logs) -> list[Trajectory]:
    """A robot seen from the other side: front is rear, and ahead is back."""
    out = []
    for log in logs:
        columns = {}
        for header, name in zip(log.headers, log.names, strict=True):
            turned = "/".join(OTHER.get(part, part) for part in header.split("/"))
            columns[turned] = -log[name] if name.endswith(MIRRORED) else log[name]
        out.append(Trajectory(log.time, columns, log.meta))
    return out


CHANGES: dict[str, Change] = {
    "columns permuted": permuted,
    "time shifted": later,
    "two halves": halved,
    "half the rate": coarser,
    "noise redrawn": noisier,
}


def written(logs: Iterable[Trajectory], folder: Path) -> list[Path]:
    """The logs as files."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for log in logs:
        path = folder / f"{log.meta['name']}.csv"
        kept = {k: v for k, v in log.meta.items() if k in ("kind", "noise")}
        columns = {h: log[n] for h, n in zip(log.headers, log.names, strict=True)}
        Trajectory(log.time, columns, kept).write(path)
        paths.append(path)
    return paths


UNITS = {"m": ("mm", 1e3), "N": ("kN", 1e-3), "s": ("ms", 1e3), "rad": ("deg", 180.0 / np.pi)}


def in_other_units(logs: Iterable[Trajectory], folder: Path) -> tuple[list[Path], Path]:
    """The logs as another program's files, in other units and the other sign, and their map."""
    folder.mkdir(parents=True, exist_ok=True)
    paths, columns = [], {}
    for log in logs:
        table = [log.time * 1e3]
        columns = {"time [s]": {"source": "t", "unit": "ms"}}
        for i, (header, name) in enumerate(zip(log.headers, log.names, strict=True)):
            unit, factor = UNITS.get(log.unit(name), (log.unit(name), 1.0))
            sign = -1 if "valve" not in name else 1
            columns[header] = {"source": f"c{i}", "unit": unit, "sign": sign}
            table.append(sign * factor * log[name])
        head = ",".join(["t", *(f"c{i}" for i in range(len(log.names)))])
        path = folder / f"{log.meta['name']}.csv"
        np.savetxt(path, np.column_stack(table), "%.12g", ",", header=head, comments="")
        paths.append(path)
    kind = {"kind": str(next(iter(logs)).meta["kind"])} if paths else {}
    dump_yaml({**kind, "columns": columns}, folder / "map.yaml")
    return paths, folder / "map.yaml"


def read(paths: Iterable[Path]) -> list[Trajectory]:
    """The logs in files."""
    return [read_log(path) for path in paths]
