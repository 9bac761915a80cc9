"""Units that nothing tells: by usual sizes, never silently those of another column."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from foreign_files import robot_log
from strange_logs import PLAIN, UNITS, noisy

from kemba.identify.logs.reading import read_log
from kemba.logs import load_map
from kemba.logs.draft.draft import Draft, draft_map
from kemba.logs.draft.sizes import SIZES, _fits
from kemba.logs.draft.words import named_unit

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
        ("front_hip_tau", "front_hip_tau [Nm]", 1.0, "Nm", ""),
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
    ("changes", "other"),
    [
        ({"body_z": ("body_z_cm", 1e2)}, "may be cm"),
        ({"rear_hip_tau": ("rear_hip_tau", 1e3)}, "may be something else"),
    ],
)
def test_what_else_a_unit_may_be_is_told(
    changes: dict[str, tuple[str, float]], other: str, tmp_path: Path
) -> None:
    (question,) = drafted(tmp_path, **changes).questions
    assert question.endswith(other)


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


@pytest.mark.parametrize(
    ("rig", "logged", "columns", "asked"),
    [
        ("drive", {"axis/q": "m", "axis/tau": "N"}, {"position": 6.7, "force": 30.0}, "in, but"),
        ("drive", {"axis/q": "rad", "axis/tau": "N.m"}, {"position": 2.0, "torque": 120.0},
         "N.m, but"),
        ("vessel", {"vessel/P": "Pa", "vessel/T": "K"}, {"tank pressure": 7e5, "temp": 68.0},
         "degF, but"),
    ],
)  # fmt: skip
def test_what_other_units_are_usual_too_is_asked_about(
    rig: str, logged: dict[str, str], columns: dict[str, float], asked: str, tmp_path: Path
) -> None:
    """Inches beside centimetres, Fahrenheit beside Celsius, the torque of a small drive in mN.m
    beside that of a large one."""
    time = np.linspace(0.0, 4.0, 400)
    table = {"time": time, **{name: size * np.cos(0.3 * time) for name, size in columns.items()}}
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    (question,) = draft_map(tmp_path / "log.csv", (), None, rig, logged).questions
    assert f"taken as {asked} may be" in question


@pytest.mark.parametrize(
    ("size", "unit", "asked"),
    [(60.0, None, False), (0.06, "kN", False), (3.0, "kN", True), (6e4, None, True)],
)
def test_a_force_without_a_unit_is_told_by_its_size(
    size: float, unit: str | None, asked: bool, tmp_path: Path
) -> None:
    """Of a rod: 0.06 is in kN, 3 may be, 60 000 is in no usual one."""
    time = np.linspace(0.0, 4.0, 400)
    table = {"t": time, "rod x [mm]": 30 * np.sin(time), "rod force": size * np.cos(time)}
    table |= {f"valve {side}": (time * 7 % 2 < 1).astype(float) for side in ("extend", "retract")}
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    draft = draft_map(tmp_path / "log.csv", ())
    assert draft.columns["piston/F [N]"].get("unit") == unit
    assert bool(draft.questions) is asked


@pytest.mark.parametrize("unit", ["lbf", "kgf", "mNm", "um", "rev", "ft", "K"])
def test_units_behind_a_name(unit: str) -> None:
    assert named_unit(f"front_{unit}") == ("front", unit)
    assert named_unit("temp_C") == ("temp", "degC")


def test_pressures_in_megapascals(tmp_path: Path) -> None:
    log = robot_log()
    table = {n.replace("/", "_"): log[n] for n in log.names}
    table |= {f"front_{side}_pressure": 0.1 + 0.5 * log[f"front/valve/{side}"]
              for side in ("extend", "retract")}  # fmt: skip
    pd.DataFrame({"time": log.time, **table}).to_csv(tmp_path / "log.csv", index=False)
    draft = draft_map(tmp_path / "log.csv", ("front", "rear"), 0.07)
    assert units(draft)["front/chamber/extend/P"] == "MPa"


@pytest.mark.parametrize("seed", range(8))
def test_columns_with_units_and_without_are_read_right_or_asked_about(
    seed: int, tmp_path: Path
) -> None:
    """Each column in a unit drawn at random, which its header tells or not."""
    rng = np.random.default_rng(seed)
    log = noisy(rng)
    table = {"time": log.time}
    for name in log.names:
        unit, size = (ways := UNITS.get(log.unit(name), [("", 1.0)]))[rng.integers(len(ways))]
        told = unit and rng.random() < 0.5
        plain = PLAIN.get(log.unit(name), [("", 1.0)])[-1 if rng.random() < 0.3 else 0][1]
        label = name.replace("/", "_") + (f" [{unit}]" if told else "")
        table[label] = log[name] * (size if told else plain)
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    draft = draft_map(tmp_path / "log.csv", ("front", "rear"), 0.07)
    (tmp_path / "map.yaml").write_text(draft.text("log.csv"))
    back = read_log(tmp_path / "log.csv", load_map(tmp_path / "map.yaml"))
    for name in log.names:
        if not any(name in question for question in draft.questions):
            assert back[name] == pytest.approx(log[name], abs=5e-3), name


def test_a_hip_turns_by_a_turn_at_most() -> None:
    """What reads 7 is no angle in rad, and what reads 6.3 may be one."""
    assert _fits(6.3, "rad", "rad", SIZES["hip/q"])
    assert not _fits(7.0, "rad", "rad", SIZES["hip/q"]) and _fits(7.0, "deg", "rad", SIZES["hip/q"])
