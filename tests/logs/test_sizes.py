"""Units that nothing tells: by usual sizes, never silently those of another column."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from foreign_files import robot_log

from kemba.logs.draft.draft import Draft, draft_map

DEGREES = np.degrees(1)


def drafted(path: Path, **changes: tuple[str, float]) -> Draft:
    """The draft of a log in SI units without any named, but for columns that have another `name`
    and are `factor` times as large."""
    log = robot_log()
    table = {"time": log.time, **{n.replace("/", "_"): log[n] for n in log.names}}
    for column, (name, factor) in changes.items():
        table[name] = factor * table.pop(column)
    pd.DataFrame(table).to_csv(path / "log.csv", index=False)
    return draft_map(path / "log.csv", ("front", "rear"), 0.07)


def units(draft: Draft) -> dict[str, str]:
    return {h.split(" [")[0]: s["unit"] for h, s in draft.columns.items() if "unit" in s}


@pytest.mark.parametrize(
    ("column", "name", "factor", "unit", "open_"),
    [
        ("body_z", "body_z_cm", 1e2, "cm", "body/x"),
        ("body_z", "body_z [ft]", 1 / 0.3048, "ft", "body/x"),
        ("body_z", "body_z [mm/10]", 1e4, "mm/10", "body/x"),
        ("front_hip_q", "front_hip_q [mrad]", 1e3, "mrad", "body/pitch"),
        ("front_hip_tau", "front_hip_tau [mN.m]", 1e3, "mN.m", ""),
        ("body_pitch", "body_pitch_deg", DEGREES, "deg", ""),
        ("front_piston_x", "front_piston_x [mm]", 1e3, "mm", ""),
        ("rear_hip_tau", "rear_hip_tau", 1e3, "", "hip/tau"),
    ],
)
def test_a_unit_is_that_of_its_own_column(
    column: str, name: str, factor: float, unit: str, open_: str, tmp_path: Path
) -> None:
    draft = drafted(tmp_path, **{column: (name, factor)})
    path = column.replace("_", "/")
    if unit:
        assert units(draft) == {path: unit}
    assert all(open_ in question for question in draft.questions)
    assert bool(draft.questions) == bool(open_)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"body_z": 1e3}, {"body/z": "mm"}),
        ({"front_hip_tau": 1e3, "rear_hip_tau": 1e3}, {"front/hip/tau": "mN.m"}),
        ({"front_hip_q": DEGREES, "rear_hip_q": DEGREES}, {"front/hip/q": "deg"}),
        ({"body_pitch": 3 * DEGREES}, {"body/pitch": "deg"}),
    ],
)
def test_sizes_tell_units(
    changes: dict[str, float], expected: dict[str, str], tmp_path: Path
) -> None:
    """And where they contradict the others, or leave another unit possible, this is asked."""
    draft = drafted(tmp_path, **{name: (name, factor) for name, factor in changes.items()})
    assert expected.items() <= units(draft).items()
    assert draft.questions or "tau" in str(changes)


def test_pressures_in_megapascals(tmp_path: Path) -> None:
    log = robot_log()
    table = {n.replace("/", "_"): log[n] for n in log.names}
    table |= {f"front_{side}_pressure": 0.1 + 0.5 * log[f"front/valve/{side}"]
              for side in ("extend", "retract")}  # fmt: skip
    pd.DataFrame({"time": log.time, **table}).to_csv(tmp_path / "log.csv", index=False)
    draft = draft_map(tmp_path / "log.csv", ("front", "rear"), 0.07)
    assert units(draft)["front/chamber/extend/P"] == "MPa"
