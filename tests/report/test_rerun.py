"""Recordings for the Rerun viewer hold the robot, its plan, every column, and their layout."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foreign_files import robot_log

from kemba.errors import KembaError
from kemba.plotting.source import Source
from kemba.report.view import write_rerun
from kemba.trajectory import Trajectory


def motion() -> Trajectory:
    return robot_log(200)


def test_without_its_package_the_way_out_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(KembaError, match=r"'rerun-sdk', which is not installed.*kemba\[rerun\]"):
        write_rerun(Source("log", motion()), tmp_path / "a.rrd")
    with pytest.raises(KembaError, match=r"no format .\.html.; a name ending in \.rrd was"):
        write_rerun(Source("log", motion()), tmp_path / "a.html")
    assert not list(tmp_path.iterdir())


@pytest.mark.filterwarnings("ignore")  # those of an outside package that is not in the tests' extra
def test_robot_plan_and_columns_are_in_a_recording(tmp_path: Path) -> None:
    chunk: Any = pytest.importorskip("rerun.chunk", reason="rerun-sdk is not installed")
    log, plan = motion(), motion()
    log["body/z"][:50] = np.nan
    path = write_rerun(
        Source("log", log), tmp_path / "a.rrd", ghost=Source("plan", plan, plan=True)
    )
    assert list(tmp_path.iterdir()) == [path]
    reader = chunk.RrdReader(path)
    assert len(reader.blueprints()) == len(reader.recordings()) == 1
    rows = {c.entity_path: c.num_rows for c in reader.stream() if not c.is_static}
    assert {"/scene/log", "/scene/plan"} <= rows.keys()
    for name in log.names:
        assert rows[f"/log/{name}"] == np.isfinite(log[name]).sum(), name
        assert rows[f"/plan/{name}"] == len(plan), name
    layout = {
        c.entity_path: c.to_record_batch() for c in reader.stream(store=reader.blueprints()[0])
    }
    title, query = "ViewBlueprint:display_name", "ViewContents:query"
    views = {
        part[title][0].as_py()[0]: layout[f"{place}/ViewContents"][query][0].as_py()
        for place, part in layout.items()
        if title in part.schema.names
    }
    assert views.pop("robot") == ["$origin/**"]
    plotted = {name for contents in views.values() for name in contents}
    assert {f"+ /{whose}/{n}" for whose in ("log", "plan") for n in log.names} == plotted
