"""How tables of other programs are spelt: thousands, no readings, switches, lines, encodings."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from foreign_files import robot_log

from kemba.errors import KembaError
from kemba.identify.logs.reading import read_log
from kemba.logs import ColumnMap, load_map
from kemba.logs.draft.draft import Draft, draft_map
from kemba.logs.text import as_numbers
from kemba.trajectory import Trajectory

LOG = robot_log()
LEGS = ("front", "rear")


def table(**other: object) -> pd.DataFrame:
    """The log as another program has it, with some columns as said."""
    columns = {"time": LOG.time, **{name.replace("/", "_"): LOG[name] for name in LOG.names}}
    return pd.DataFrame(columns | other)


def read(path: Path) -> tuple[Draft, Trajectory]:
    """The draft, and the log that its map makes of the file."""
    draft = draft_map(path, LEGS, 0.07)
    path.with_suffix(".yaml").write_text(draft.text(path.name), encoding="utf-8")
    return draft, read_log(path, load_map(path.with_suffix(".yaml")))


@pytest.mark.parametrize(
    ("cells", "decimal", "expected"),
    [
        (["1,234.5", "999.5", "-12,345.25"], ".", [1234.5, 999.5, -12345.25]),
        (["1.234,5", "999,5"], ",", [1234.5, 999.5]),
        (["1 234,5", "12 345 678,5"], ",", [1234.5, 12345678.5]),
        (["1\u00a0234,5", "1\u202f234,5"], ",", [1234.5, 1234.5]),
        (["1'234.5", "1\u2019234.5"], ".", [1234.5, 1234.5]),
        (["1.234", "945"], ",", [1234, 945]),  # 945 without decimals: the point parts
        (["1.234.567", "1.234"], ",", [1234567, 1234]),
        (["1.234", "2.345"], ",", None),  # may be decimals: asked
        (["1.234", "0.345"], ",", None),
        (["1.234", "1945"], ",", None),
        (["1.234", "1.25"], ",", None),
        (["1,234", "2345.5"], ".", None),
        (["1.5D+03", "-2.5d-01"], ".", [1500, -0.25]),
        (["1,5D+03", "2"], ",", [1500, 2]),
        (["0x1F", "0x20"], ".", [31, 32]),
        (["\u22121.5", "2"], ".", [-1.5, 2]),
    ],
)
def test_numbers_in_other_spellings(
    cells: list[str], decimal: str, expected: list[float] | None
) -> None:
    values, wrong = as_numbers(np.array(cells, dtype=object), decimal)
    if expected is None:
        assert wrong.any()
    else:
        np.testing.assert_allclose(values, expected)
        assert not wrong.any()


@pytest.mark.parametrize(
    "mark", "? . -- **** 1.#QNAN -1.#IND -nan(ind) nan(0x7ff8) #NV #WERT! #DIV/0! \u2013".split()
)
def test_marks_of_no_reading(mark: str) -> None:
    values, wrong = as_numbers(np.array([mark, "1"], dtype=object), ".")
    assert np.isnan(values[0]) and values[1] == 1 and not wrong.any()


NUMBERS = ["9999", "-9999.99", "32767"]


@pytest.mark.parametrize(
    ("ending", "mark"),
    [(".csv", m) for m in ["OVER", "k.A.", "欠測", "inf", *NUMBERS]]
    + [(".parquet", m) for m in NUMBERS],  # a column of numbers has no words
)
def test_what_means_no_reading_is_found_and_said(mark: str, ending: str, tmp_path: Path) -> None:
    """A word again and again, the infinite, nines and the last of 16 bit, far from the rest."""
    rows = [3, 33, 34]
    height = table()["body_z"].astype(object if ending == ".csv" else float)
    height[rows] = mark if ending == ".csv" else float(mark)
    path = tmp_path / f"log{ending}"
    frame = table(body_z=height)
    frame.to_csv(path, index=False) if ending == ".csv" else frame.to_parquet(path)
    draft, back = read(path)
    assert not draft.questions and not draft.missing
    assert np.flatnonzero(np.isnan(back["body/z"])).tolist() == rows
    assert any("no reading where these stand" in note for note in draft.notes)


def test_a_word_that_stands_once_is_told_with_the_key_for_it(tmp_path: Path) -> None:
    height = table()["body_z"].astype(object)
    height[7] = "OVER"
    table(body_z=height).to_csv(tmp_path / "log.csv", index=False)
    with pytest.raises(KembaError, match=r"log.csv:9:3: body_z: 'OVER' .*`missing: \[OVER\]`"):
        read(tmp_path / "log.csv")


def test_readings_that_saturate_are_kept(tmp_path: Path) -> None:
    """A force that stays at its largest is no mark; nor is a number of nines near the others."""
    force = np.minimum(20 * np.abs(np.sin(20 * LOG.time)) ** 9, 15.0)
    draft_of = table(front_piston_F=force, distance=np.where(LOG.time > 0.3, 99, 80 * LOG.time))
    draft_of.to_csv(tmp_path / "log.csv", index=False)
    assert "missing" not in read(tmp_path / "log.csv")[0].layout


def test_an_infinite_number_matters_in_a_mapped_column_alone(tmp_path: Path) -> None:
    table(other=[np.inf, *LOG.time[1:]]).to_csv(tmp_path / "log.csv", index=False)
    columns = {"time [s]": {"source": "time"}, "body/z [m]": {"source": "body_z"}}
    assert len(read_log(tmp_path / "log.csv", ColumnMap(columns=columns))) == len(LOG)
    columns["body/z [m]"] = {"source": "other"}
    with pytest.raises(KembaError, match=r"log.csv:2:15: other: the number is infinite; .*missing"):
        read_log(tmp_path / "log.csv", ColumnMap(columns=columns))


@pytest.mark.parametrize(
    ("on", "off"),
    [("open", "closed"), ("HIGH", "LOW"), ("EIN", "AUS"), ("WAHR", "FALSCH"), ("ouvert", "fermé"),
     ("Yes", "No"), ("オン", "オフ"), ("T", "F"), ("energized", "de-energized")],
)  # fmt: skip
def test_valves_in_words(on: str, off: str, tmp_path: Path) -> None:
    valves = [name for name in LOG.names if "valve" in name]
    words = {n.replace("/", "_"): np.where(LOG[n] > 0.5, on, off) for n in valves}
    table(**words).to_csv(tmp_path / "log.csv", index=False)
    draft, back = read(tmp_path / "log.csv")
    assert not draft.missing
    for name in valves:
        np.testing.assert_array_equal(back[name], LOG[name])


@pytest.mark.parametrize("word", ["closed", "inverted"])
def test_a_valve_that_is_named_by_what_it_is_not_is_a_question(word: str, tmp_path: Path) -> None:
    frame = table().rename(columns={"front_valve_extend": f"front_valve_extend_{word}"})
    frame.to_csv(tmp_path / "log.csv", index=False)
    draft = draft_map(tmp_path / "log.csv", LEGS, 0.07)
    assert [text.split(":")[0] for text in draft.questions] == ["front/valve/extend [1]"]
    assert "`threshold: 0.5, sign: -1`" in draft.questions[0]


def test_a_valve_of_unknown_words_is_not_taken(tmp_path: Path) -> None:
    words = {"front_valve_extend": np.where(LOG["front/valve/extend"] > 0.5, "Extend", "Off")}
    table(**words).to_csv(tmp_path / "log.csv", index=False)
    assert "front/valve/extend [1]" in draft_map(tmp_path / "log.csv", LEGS, 0.07).missing


@pytest.mark.parametrize(
    ("label", "counts"),
    [("[barg]", True), ("[bar(g)]", True), ("[psig]", True), ("[MPaG]", True), ("[bar rel]", True),
     ("[bara]", False), ("[psi abs]", False), ("gauge [bar]", True), ("relative [bar]", True),
     ("absolute [bar]", False), ("[bar]", None)],
)  # fmt: skip
def test_where_a_pressure_counts_from_is_told_by_its_name(
    label: str, counts: bool | None, tmp_path: Path
) -> None:
    """It never falls to that of the air here; what nothing tells is said."""
    size = {"psi": 6894.757, "MPa": 1e6}.get(label.strip("[")[:3], 1e5)
    pressure = 5e5 + 1e5 * np.sin(9 * LOG.time)
    written = (pressure - 101_325 * bool(counts)) / size
    table(**{f"supply_pressure {label}": written}).to_csv(tmp_path / "log.csv", index=False)
    draft, back = read(tmp_path / "log.csv")
    np.testing.assert_allclose(back["supply/P"], pressure, rtol=1e-6)
    assert any("taken as absolute" in note for note in draft.notes) is (counts is None)


@pytest.mark.parametrize("coded", ["utf-16-le", "utf-16-be", "utf-16", "utf-32", "cp932", "cp1252"])
def test_encodings(coded: str, tmp_path: Path) -> None:
    label = {"cp932": "時刻、秒", "cp1252": "Zeit °"}.get(coded, "time")
    text = table().rename(columns={"time": label}).to_csv(index=False)
    (tmp_path / "log.csv").write_bytes(text.encode(coded))
    columns = {"time [s]": {"source": label}, "body/z [m]": {"source": "body_z"}}
    back = read_log(tmp_path / "log.csv", ColumnMap(columns=columns))
    np.testing.assert_allclose(back["body/z"], LOG["body/z"])


@pytest.mark.parametrize(("part", "size"), [("ms", 1e3), ("Milliseconds", 1e3), ("usec", 1e6)])
def test_what_is_below_a_second_may_stand_beside_a_clock(
    part: str, size: float, tmp_path: Path
) -> None:
    began = pd.Timestamp("2026-11-30 23:59:59.8").value
    stamps = pd.to_datetime(began + np.round(1e9 * LOG.time).astype(np.int64))
    clock = {"Date": stamps.strftime("%d.%m.%Y"), "Time": stamps.strftime("%H:%M:%S")}
    below = np.round(size * (stamps.microsecond.to_numpy() / 1e6)).astype(int)
    frame = table().drop(columns="time").assign(**clock, **{part: below})
    frame.to_csv(tmp_path / "log.csv", index=False)
    draft, back = read(tmp_path / "log.csv")
    assert not draft.missing and not draft.questions
    np.testing.assert_allclose(back.time - back.time[0], LOG.time, atol=1e-6)


@pytest.mark.parametrize("remark", ["", "# trigger\n"])
@pytest.mark.parametrize("bits", [16, 32])
def test_a_counter_that_begins_anew_is_joined_and_said(
    bits: int, remark: str, tmp_path: Path
) -> None:
    ticks = (2**bits - 200 + np.round(1e3 * LOG.time).astype(int)) % 2**bits
    table().drop(columns="time").assign(tick_ms=ticks).to_csv(tmp_path / "log.csv", index=False)
    with (tmp_path / "log.csv").open("a", encoding="utf-8") as stream:
        stream.write(remark)
    back = read(tmp_path / "log.csv")[1]
    np.testing.assert_allclose(back.time - back.time[0], LOG.time, atol=1e-9)
    assert f"begins anew after {2**bits}" in back.meta["read"][-1]


def test_two_runs_in_one_file_are_not_joined(tmp_path: Path) -> None:
    """The second begins at 0, and not where the first ends."""
    long = np.round(63_000 / 399 * np.arange(400)).astype(int)
    frame = pd.concat([table().assign(time=long)] * 2).rename(columns={"time": "tick_ms"})
    frame.to_csv(tmp_path / "log.csv", index=False)
    columns = {"time [s]": {"source": "tick_ms", "unit": "ms"}, "body/z [m]": {"source": "body_z"}}
    assert np.any(np.diff(read_log(tmp_path / "log.csv", ColumnMap(columns=columns)).time) < 0)


@pytest.mark.parametrize(
    ("text", "what", "way_out"),
    [
        ('t,x\n"0,5","1,5"\n"0,6","1,6"\n', "has commas both", "`;` between the cells"),
        ("t: 0.1, x: 2\nt: 0.2, x: 3\n", "names each number in each row", "once, in a header"),
        ("".join(f"c{i}," + ",".join(str(i * j % 7) for j in range(99)) + "\n" for i in (3, 5, 2)),
         "it lies on its side", "index_col=0"),
        ("time,x,y\n" + "".join(f"{9 - i},{i % 3},{i % 4}\n" for i in range(9)),
         "'time' falls from row to row", "turn the order"),
        ("time,x,y\n" + "".join(f"{i // 20},{i % 3},{i % 4}\n" for i in range(60)),
         "'time' stays the same in 97% of the steps", "more digits"),
        ("Zeit,x,y\n" + "".join(f"Montag,{i % 3},{i % 4}\n" for i in range(9)),
         "'Zeit' holds 'Montag', which is no time", "`unit: 2 ms`"),
    ],
)  # fmt: skip
def test_why_a_table_is_refused_and_the_way_out(
    text: str, what: str, way_out: str, tmp_path: Path
) -> None:
    (tmp_path / "log.csv").write_text(text, encoding="utf-8")
    with pytest.raises(KembaError) as told:
        draft_map(tmp_path / "log.csv", LEGS, 0.07)
    assert what in str(told.value) and way_out in str(told.value)


def test_a_clock_written_in_digits_is_asked_about_where_it_leaps(tmp_path: Path) -> None:
    clock = pd.to_datetime("2025-12-19 12:30:59.8") + pd.to_timedelta(LOG.time, "s")
    table(time=clock.strftime("%H%M%S.%f")).to_csv(tmp_path / "log.csv", index=False)
    assert "hhmmss" in draft_map(tmp_path / "log.csv", LEGS, 0.07).questions[0]


def test_of_equal_columns_of_one_name_the_first_is_read_by_its_number(tmp_path: Path) -> None:
    frame = table()
    pd.concat([frame, frame["body_z"]], axis=1).to_csv(tmp_path / "log.csv", index=False)
    draft, back = read(tmp_path / "log.csv")
    assert draft.columns["body/z [m]"]["source"] == 3
    np.testing.assert_allclose(back["body/z"], LOG["body/z"])


def test_a_row_of_descriptions_is_none_of_units(tmp_path: Path) -> None:
    head, *rows = table().to_csv(index=False).split("\n")
    names = head.split(",")
    units = ["s" if n == "time" else "-" for n in names]
    about = [f"channel {i}" for i in range(len(names))]
    lines = [head, ",".join(about), ",".join(units), *rows]
    (tmp_path / "log.csv").write_text("\n".join(lines), encoding="utf-8")
    assert not draft_map(tmp_path / "log.csv", LEGS, 0.07).questions
