"""Maps that are drafted for logs of other programs."""

from pathlib import Path

import foreign_files
import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner, Result

from kemba.errors import KembaError
from kemba.identify.logs.reading import needed, read_log
from kemba.logs import ColumnMap, ColumnSource, load_map, open_log
from kemba.logs.draft.draft import draft_map, layout_of
from kemba.logs.draft.matching import bench_targets, robot_targets
from kemba.logs.draft.words import meaning, named_unit
from kemba_cli.main import app

LEGS = ("front", "rear")
FILES = {
    "german": ("log.csv", foreign_files.german),
    "snake": ("log.parquet", foreign_files.snake),
    "abbreviated": ("log.csv", foreign_files.abbreviated),
    "player": ("log.tsv", foreign_files.player),
    "workshop": ("log.csv", foreign_files.workshop),
    "camel": ("log.csv", foreign_files.camel),
    "units below": ("log.txt", foreign_files.units_below),
}


def call(*words: str) -> Result:
    return CliRunner().invoke(app, list(words))


@pytest.mark.parametrize("program", FILES)
def test_a_drafted_map_gives_the_log_back(program: str, tmp_path: Path) -> None:
    log = foreign_files.robot_log()
    name, write = FILES[program]
    path = write(log, tmp_path / name)
    done = call("map", str(path), "--out", str(tmp_path / "map.yaml"))
    assert done.exit_code == 0, done.stderr
    assert f"kemba-opt check {path} --map {tmp_path / 'map.yaml'}" in done.stderr
    back = read_log(path, load_map(tmp_path / "map.yaml"))
    assert set(needed(back)) <= set(back.names)
    assert np.allclose(back.time, log.time, atol=2e-7)
    for column in needed(log):
        assert np.allclose(back[column], log[column], atol=1e-9), column


def test_joint_states_without_a_header(tmp_path: Path) -> None:
    """Joints are found; what a JointState does not hold is said to be missing."""
    log = foreign_files.robot_log()
    path = foreign_files.joint_state(log, tmp_path / "log.csv")
    done = call("map", str(path), "--out", str(tmp_path / "map.yaml"), "--json")
    assert done.exit_code == 1
    assert "'body/z [m]'" in done.stderr and "'front/valve/extend [1]'" in done.stderr
    back = read_log(path, load_map(tmp_path / "map.yaml"))
    assert np.allclose(back.time, log.time, atol=2e-9)
    for leg in LEGS:
        for column in ("hip/q", "hip/tau", "piston/x"):
            assert np.allclose(back[f"{leg}/{column}"], log[f"{leg}/{column}"]), column


def test_a_bench_log_in_volts_and_bar(tmp_path: Path) -> None:
    path = tmp_path / "bench.txt"
    i = np.arange(400)
    on = 4.9 * (i // 50 % 2)
    rows = np.column_stack([i, 20 + i % 40, on, 4.9 - on, 0.1 + i / 100, i - 200])
    head = "made by a logger\nt_ms pos_mm valve_1 valve_2 p_ext loadcell\nms mm V V bar N\n"
    with path.open("w") as stream:
        stream.write(head)
        np.savetxt(stream, rows, fmt="%.6g")
    draft = draft_map(path, LEGS)
    assert draft.kind == "bench" and not draft.missing
    assert draft.layout == {"separator": "whitespace", "skip_rows": 1, "skip_below": 1}
    assert draft.columns["time [s]"] == {"source": "t_ms", "unit": "ms"}
    assert draft.columns["piston/x [m]"] == {"source": "pos_mm", "unit": "mm"}
    assert draft.columns["valve/extend [1]"] == {"source": "valve_1", "threshold": 2.45}
    pressure = draft.columns["chamber/extend/P [Pa]"]
    assert pressure == {"source": "p_ext", "unit": "bar", "offset": "1.01325 bar"}


def test_pressures_of_one_logger_count_from_one_zero(tmp_path: Path) -> None:
    """A chamber falls to the atmosphere, the supply never does: it is a gauge pressure as well."""
    log = foreign_files.robot_log()
    table = {"time [s]": log.time, **{n.replace("/", "_"): v for n, v in log.columns.items()}}
    table["front_chamber_extend_p [bar]"] = 3.0 + 3.0 * np.sin(9.0 * log.time)
    table["front_chamber_extend_p [bar]"] -= table["front_chamber_extend_p [bar]"].min()
    table["supply_p [bar]"] = np.full(len(log), 6.0)
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    draft = draft_map(tmp_path / "log.csv", LEGS, 0.07)
    for header in ("front/chamber/extend/P [Pa]", "supply/P [Pa]"):
        assert draft.columns[header]["offset"] == "1.01325 bar"
    assert any("'supply_p [bar]': from the atmosphere" in note for note in draft.notes)


@pytest.mark.parametrize("name", ["knee_angle", "knee_pos"])
def test_an_angle_of_a_knee_is_no_length_of_a_piston(name: str, tmp_path: Path) -> None:
    """Its size alone would be that of a piston in cm."""
    log = foreign_files.robot_log()
    table = {"time [s]": log.time, **{n.replace("/", "_"): v for n, v in log.columns.items()}}
    for leg in LEGS:
        table[f"{leg}_{name}"] = 0.8 + 6.0 * table.pop(f"{leg}_piston_x [m]")
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    draft = draft_map(tmp_path / "log.csv", LEGS, 0.07)
    if name == "knee_angle":
        assert draft.missing == ("front/piston/x [m]", "rear/piston/x [m]")
    else:
        asked = "front/piston/x [m]: is 'front_knee_pos' the piston's way, or the knee's angle?"
        assert asked in draft.questions


def test_a_line_that_is_no_data_leaves_the_step_of_the_rows_known(tmp_path: Path) -> None:
    """It is left out, and said."""
    path = foreign_files.abbreviated(foreign_files.robot_log(), tmp_path / "log.csv")
    path.write_text(path.read_text() + "End of file\n")
    draft = draft_map(path, LEGS, 0.07)
    assert not draft.questions and not draft.missing
    (tmp_path / "map.yaml").write_text(draft.text("log.csv"))
    back = open_log(path, load_map(tmp_path / "map.yaml"))
    assert len(back) == 400
    assert back.meta["read"] == ["lines that are no rows are left out: 'End of file'"]


def test_a_valve_that_never_switches_has_the_threshold_of_the_others(tmp_path: Path) -> None:
    log = foreign_files.robot_log()
    still = log.with_columns({"rear/valve/retract [1]": np.zeros(len(log))})
    draft = draft_map(foreign_files.german(still, tmp_path / "log.csv"), LEGS)
    assert draft.columns["rear/valve/retract [1]"]["threshold"] == 12.0


def test_units_that_nothing_tells_are_shared(tmp_path: Path) -> None:
    """A jump on the spot has a small way forward and a small pitch, in the unit of the others."""
    log = foreign_files.robot_log()
    table = {"time": log.time}
    for name in log.names:
        scale = {"m": 1e3, "rad": np.degrees(1)}.get(log.unit(name), 1.0)
        still = 0.01 if name in ("body/x", "body/pitch") else 1.0
        table[name.replace("/", "_")] = still * scale * log[name]
    path = tmp_path / "log.csv"
    np.savetxt(
        path,
        np.column_stack(list(table.values())),
        delimiter=",",
        header=",".join(table),
        comments="",
    )
    units = {header: source.get("unit") for header, source in draft_map(path, LEGS).columns.items()}
    assert units["body/x [m]"] == units["body/z [m]"] == "mm"
    assert units["body/pitch [rad]"] == units["front/hip/q [rad]"] == "deg"


def test_a_drive_is_recognised(tmp_path: Path) -> None:
    t = np.arange(100) * 1e-3
    path = tmp_path / "drive.csv"
    rows = "\n".join(f"{a},{b},{c}" for a, b, c in zip(t, 0.3 * t, 5 * t, strict=True))
    path.write_text(f"t,position,force\n{rows}\n")
    draft = draft_map(path, LEGS)
    assert draft.kind == "drive"
    assert list(draft.columns) == ["time [s]", "axis/q [m]", "axis/tau [N]"]


@pytest.mark.parametrize("part", ["motor", "drive", "shaft"])
def test_the_motor_of_a_drive_is_its_axis(part: str, tmp_path: Path) -> None:
    t = np.arange(100) * 1e-3
    table = {"t/s": t, f"{part} position [rev]": np.sin(9 * t), f"{part} torque/mNm": 300 * t}
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    logged = {"axis/q": "rad", "axis/tau": "N.m"}
    draft = draft_map(tmp_path / "log.csv", LEGS, rig="drive", logged=logged)
    units = [source.get("unit") for source in draft.columns.values()]
    assert not draft.missing and not draft.questions and units == [None, "rev", "mNm"]


@pytest.mark.parametrize(
    ("label", "told"),
    [
        ("force [N*10]", "multiplied by 10?"),
        ("force_x100_N", "multiplied by 100?"),
        ("force [N x 1e3]", "multiplied by 1e3?"),
        ("force [N*0.1]", "multiplied by 0.1?"),
        ("force", "no unit is told for 'force', at most 5e+04"),
        ("force [0.1 N]", ""),
        ("force_x1 [N]", ""),
    ],
)
def test_a_factor_behind_a_unit_may_be_of_either(label: str, told: str, tmp_path: Path) -> None:
    """Of the readings, as by `x1000` mostly, or of the unit: a person knows."""
    t = np.arange(100) * 1e-3
    table = {"time": t, "position [m]": np.sin(9 * t), label: 5e4 * np.cos(9 * t)}
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    logged = {"axis/q": "m", "axis/tau": "N"}
    asked = draft_map(tmp_path / "log.csv", LEGS, rig="drive", logged=logged).questions
    assert told in " ".join(asked) and bool(asked) == bool(told)


def test_valves_are_told_by_what_they_are_told_to_do(tmp_path: Path) -> None:
    """Of a command and its echo, the command counts."""
    t = np.arange(200) * 1e-3
    table = {"time": t, "displacement_mm": 30 + 20 * np.sin(9 * t), "load_cell": 50 * np.cos(9 * t)}
    for i, side in enumerate(("extend", "retract")):
        table[f"{side}_cmd"] = (t * 1e3 % 50 < 20 + 9 * i).astype(float)
        table[f"{side}_fb"] = np.roll(table[f"{side}_cmd"], 6)
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    draft = draft_map(tmp_path / "log.csv", LEGS, 0.07)
    assert draft.kind == "bench" and not draft.questions + draft.missing
    assert draft.columns["valve/retract [1]"]["source"] == "retract_cmd"


def test_our_own_names_need_no_guess(tmp_path: Path) -> None:
    log = foreign_files.robot_log()
    log.write(tmp_path / "log.csv")
    draft = draft_map(tmp_path / "log.csv", LEGS)
    assert set(draft.columns) == {"time [s]", *log.headers}
    assert all(source["source"] == header for header, source in draft.columns.items())


@pytest.mark.parametrize("ends", [("a", "b"), ("1", "2")])
def test_two_alike_are_asked_about(ends: tuple[str, str], tmp_path: Path) -> None:
    """A letter or a number makes neither the better one, though `b` may be a back leg and `a` an
    acceleration."""
    log = foreign_files.robot_log()
    table = {"time [s]": log.time, **{n.replace("/", "_"): v for n, v in log.columns.items()}}
    place = table.pop("body_x [m]")
    for factor, end in enumerate(ends, start=1):
        table[f"body_x_{end} [m]"] = factor * place
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    draft = draft_map(tmp_path / "log.csv", LEGS, 0.07)
    one, other = (f"'body_x_{end} [m]'" for end in ends)
    assert draft.questions == (f"body/x [m] may be {one} or {other}",)


def test_what_is_no_table_is_told(tmp_path: Path) -> None:
    (tmp_path / "note.txt").write_text("dear diary\nno numbers today\n")
    done = call("map", str(tmp_path / "note.txt"))
    assert done.exit_code == 2 and "no table that kemba recognises" in done.stderr
    assert not (tmp_path / "note_map.yaml").exists()


@pytest.mark.parametrize(
    ("text", "layout"),
    [
        ("a,b\n1.5,2\n3,4\n", {}),
        ("a;b\n1,5;2\n3;4\n", {"separator": ";", "decimal": ","}),
        ("1 2 3\n4 5 6\n", {"separator": "whitespace", "header": False}),
        ("title\n\na\tb\n1\t2\n3\t4\n", {"separator": "tab", "skip_rows": 2}),
        ("front,front,rear,rear\nx,F,P,x\n1,2,3,4\n5,6,7,8\n", {"header": 2}),
    ],
)
def test_layouts(text: str, layout: dict[str, object], tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(text)
    assert layout_of(tmp_path / "a.csv") == layout


def test_names_say_what_they_mean() -> None:
    assert named_unit("pos [mm]") == ("pos", "mm")
    assert named_unit("pos_mm") == ("pos", "mm")
    assert named_unit("hip_front") == ("hip_front", None)
    assert named_unit("Nick_Grad") == ("Nick", "deg")
    assert named_unit("pitch [degrees]") == ("pitch", "deg")
    assert meaning("frontHipTorque", LEGS) == {
        "leg": {"front"}, "part": {"hip"}, "kind": {"torque"},
    }  # fmt: skip


def test_a_mapped_cell_that_is_no_number_is_told(tmp_path: Path) -> None:
    """Columns that the map does not name may hold anything."""
    path = tmp_path / "a.csv"
    path.write_text("t;x;note\n0;0,01;start\n1;oops;\n")
    (tmp_path / "m.yaml").write_text(
        "kind: bench\nseparator: ';'\ndecimal: ','\ncolumns:\n"
        "  time [s]: {source: t, unit: ms}\n  piston/x [m]: {source: x}\n"
    )
    with pytest.raises(KembaError, match=r"a.csv:3:2: x: 'oops' is not a number"):
        read_log(path, load_map(tmp_path / "m.yaml"))


def test_a_point_that_parts_thousands_is_no_decimal_sign(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("t;x\n" + "".join(f"0,{i:03d};1.{i:03d}\n" for i in range(20)))
    columns = {"time [s]": {"source": "t"}, "axis/q [m]": {"source": "x", "unit": "um"}}
    layout = ColumnMap(separator=";", decimal=",", columns=columns)
    with pytest.raises(KembaError, match=r"log.csv:2:2: x: '1.000' is not a number"):
        read_log(path, layout)


def test_the_page_lists_the_columns_that_a_log_needs() -> None:
    page = (Path(__file__).parents[2] / "docs/logs.md").read_text(encoding="utf-8")
    for targets in (robot_targets(("LEG",)), bench_targets()):
        for target in targets:
            assert f"`{target.header}`" in page, target.header
    for entry in (*ColumnMap.model_fields, *ColumnSource.model_fields):
        assert f"{entry}:" in page or f"`{entry}`" in page, entry
