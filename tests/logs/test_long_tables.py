"""Long ("tidy") tables: one row for each time, channel and reading."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from foreign_files import robot_log

from kemba.errors import KembaError
from kemba.identify.logs.reading import needed, read_log
from kemba.logs import load_map
from kemba.logs.draft.draft import draft_map
from kemba.trajectory import Trajectory

LOG = robot_log()
DATES = pd.to_datetime("2025-12-19 12:30:54.2") + pd.to_timedelta(LOG.time, "s")
ISO = DATES.strftime("%Y-%m-%dT%H:%M:%S.%fZ")
WIDE = pd.DataFrame({"time": LOG.time, **{n.replace("/", "_"): LOG[n] for n in LOG.names}})
LONG = WIDE.melt("time", var_name="name", value_name="value")
Change = Callable[[pd.DataFrame], pd.DataFrame]


def read(path: Path) -> Trajectory:
    draft = draft_map(path, ("front", "rear"), 0.07)
    assert not draft.missing and not draft.questions
    path.with_suffix(".yaml").write_text(draft.text(path.name), encoding="utf-8")
    return read_log(path, load_map(path.with_suffix(".yaml")))


def check(back: Trajectory) -> None:
    for name in needed(LOG):
        good = np.isfinite(back[name])
        assert good.sum() > 0.08 * len(LOG), name
        at = back.time[good] - back.time[0]
        off = np.abs(back[name][good] - np.interp(at, LOG.time, LOG[name]))
        held = 0.1 if name.endswith("tau") else 2e-3  # from the row before; a valve for one row
        assert np.quantile(off, 0.95) < held, name
    assert "a long table: 13 channels" in back.meta["read"][0]


def influx(frame: pd.DataFrame) -> str:
    """A query's answer as InfluxDB writes it: a table for each channel, annotations above it."""
    stamps = frame["time"].map(dict(zip(LOG.time, ISO, strict=True)))
    found = ""
    for i, (name, rows) in enumerate(frame.groupby("name", sort=False)):
        found += "#group,false,false,true,false,false,true,true\r\n"
        found += "#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,double,string,string\r\n"
        found += "#default,_result,,,,,,\r\n,result,table,_start,_time,_value,_field,host\r\n"
        for stamp, value in zip(stamps[rows.index], rows["value"], strict=True):
            found += f",,{i},2025-12-19T00:00:00Z,{stamp},{value},{name},pi\r\n"
        found += "\r\n"
    return found


CHANGES: dict[str, Change] = {
    "by channel": lambda f: f,
    "by time": lambda f: f.sort_values(["time", "name"]),
    "own names": lambda f: f.rename(columns={"time": "Zeit", "name": "Kanal", "value": "Wert"}),
    "name first": lambda f: f[["name", "time", "value"]],
    "dates": lambda f: f.assign(time=f["time"].map(dict(zip(LOG.time, DATES, strict=True)))),
    "rates": lambda f: f[~f["name"].str.startswith("body") | f["time"].isin(LOG.time[::10])],
    "own clocks": lambda f: f.assign(time=f["time"] + 1e-5 * pd.factorize(f["name"])[0]),
    "two names": lambda f: f.assign(
        device=f["name"].str.split("_", n=1).str[0], name=f["name"].str.split("_", n=1).str[1]
    )[["time", "device", "name", "value"]],
    "units": lambda f: f.assign(
        unit=["mm" if n in ("body_x", "body_z") else "" for n in f["name"]],
        value=f["value"] * [1e3 if n in ("body_x", "body_z") else 1.0 for n in f["name"]],
    ),
}


@pytest.mark.parametrize("ending", [".csv", ".parquet", ".jsonl"])
@pytest.mark.parametrize("change", CHANGES)
def test_a_long_table_is_read_as_its_channels(change: str, ending: str, tmp_path: Path) -> None:
    path, frame = tmp_path / f"log{ending}", CHANGES[change](LONG)
    if ending == ".csv":
        frame.to_csv(path)  # with the index of pandas
    elif ending == ".parquet":
        frame.to_parquet(path)
    else:
        frame.to_json(path, orient="records", lines=True, date_format="iso", date_unit="us",
                      double_precision=15)  # fmt: skip
    check(read(path))


def test_an_answer_of_influxdb_is_read(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_bytes(influx(LONG).encode())
    check_of = read(tmp_path / "log.csv")
    assert "no rows are left out: '#group'" in check_of.meta["read"][0]
    for name in needed(LOG):
        np.testing.assert_allclose(check_of[name], LOG[name], atol=1e-9)


def test_words_of_valves_and_a_faulty_reading(tmp_path: Path) -> None:
    values = LONG["value"].astype(object)
    valves = LONG["name"].str.contains("valve")
    values[valves] = np.where(LONG["value"][valves] > 0.5, "true", "false")
    LONG.assign(value=values).to_csv(tmp_path / "log.csv", index=False)
    check(read(tmp_path / "log.csv"))
    values[777] = "oops"
    LONG.assign(value=values).to_csv(tmp_path / "log.csv", index=False)
    with pytest.raises(KembaError, match="value of body_z: 'oops' is not a number"):
        draft_map(tmp_path / "log.csv", ("front", "rear"), 0.07)


@pytest.mark.parametrize("extra", [{}, {"more": np.sin(LOG.time)}])
def test_a_table_with_a_text_beside_its_channels_is_not_long(
    extra: dict[str, object], tmp_path: Path
) -> None:
    frame = WIDE.assign(phase=np.where(LOG.time < 0.2, "stance", "flight"), **extra)
    frame.to_csv(tmp_path / "log.csv", index=False)
    np.testing.assert_allclose(read(tmp_path / "log.csv")["body/z"], LOG["body/z"])
