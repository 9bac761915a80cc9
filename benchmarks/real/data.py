"""Where real data come from, and reading them as logs. They are no part of the project.

The folder is named by KEMBA_DATA. Files are checked against their SHA-256. `fetch` downloads what
has an address; what was digitised or converted has none and must be put into the folder by hand.
"""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pooch
import yaml
from scipy.io import loadmat

from kemba.trajectory import Trajectory

REGISTRY = Path(__file__).with_name("registry.yaml")
ATMOSPHERE = 101325.0  # Pa
SEALS = {"O-ring": (1, 3, 5, 7), "KDN": (1, 3, 5, 7)}  # bar, gauge


class Absent(Exception):  # noqa: N818  no fault of the program
    """A file is not in the data folder; the text says what to do."""


@dataclass(frozen=True)
class Item:
    """One file: its SHA-256 and its address ("" where it has none)."""

    name: str
    sha256: str
    url: str


def registry() -> dict[str, Item]:
    """Every file by its path within the data folder."""
    data = yaml.safe_load(REGISTRY.read_text(encoding="utf-8"))
    return {
        name: Item(
            name,
            sha,
            (source.get("url") or "").format(name=Path(name).name, path=name.partition("/")[2]),
        )
        for source in data["sources"]
        for name, sha in source["files"].items()
    }


def find(name: str, download: bool = False) -> Path:
    """A file of the registry, checked. Raises Absent where it is not there, ValueError where its
    content is another."""
    item, folder = registry()[name], os.environ.get("KEMBA_DATA")
    if folder is None and not download:
        raise Absent(f"KEMBA_DATA names no folder; {name} would be read from it")
    root = Path(folder or pooch.os_cache("kemba"))
    for path in (root / name, root.parent / name):
        if path.is_file():
            if pooch.file_hash(str(path)) != item.sha256:
                raise ValueError(f"{path} is not the file of {REGISTRY.name}: its SHA-256 differs")
            return path
    if not download or not item.url:
        raise Absent(f"{root / name} is absent; see benchmarks/real/registry.yaml for its source")
    shelf = pooch.create(root, item.url, registry={name: item.sha256}, urls={name: item.url})
    return Path(shelf.fetch(name))


def cylinder(seal: str, bar: int, download: bool = False) -> Trajectory:
    """A cylinder log: the first 15 rows are dropped as its authors do, x is turned so that it grows
    when the rod comes out, pressures are absolute."""
    rows = np.loadtxt(find(f"cylinder/{seal}_{bar}bar.csv", download))[15:]
    time = rows[:, 0] / 1e3
    rows, time = rows[np.append(True, np.diff(time) > 0)], time[np.append(True, np.diff(time) > 0)]
    columns = {
        "piston/x [m]": 0.038 - rows[:, 4] / 1e3,
        "piston/F [N]": rows[:, 6],
        "chamber/extend/P [Pa]": rows[:, 5] * 1e5 + ATMOSPHERE,
    }
    return Trajectory(time, columns, {"kind": "cylinder"})


def emps(download: bool = False) -> Trajectory:
    """The EMPS drive: force of the motor = gtau x voltage."""
    data = loadmat(find("emps/DATA_EMPS.mat", download))
    time, q, volts = (data[name].ravel() for name in ("t", "qm", "vir"))
    force = float(data["gtau"].ravel()[0]) * volts
    return Trajectory(time, {"axis/q [m]": q, "axis/tau [N]": force}, {"kind": "drive"})


def vessel() -> Path:
    """The blow-down of air, a log as it is."""
    return find("vessel/air_790kPa_blowdown.csv")
