"""What is plotted, and when its commands act."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from kemba.errors import KembaError
from kemba.plotting import load_sources
from kemba.plotting.source import Source, default_path, load_source
from kemba.trajectory import Trajectory

SWITCHED = Trajectory([0.0, 1.0, 2.0, 3.0], {"valve [1]": [1.0, 0.0, 1.0, 1.0]})


def test_a_plans_row_acts_before_it() -> None:
    plan = Source("plan", SWITCHED, plan=True)
    assert plan.spans(SWITCHED["valve"] > 0.5) == [(1.0, 3.0)]
    assert plan.held("valve").tolist() == [0.0, 0.0, 1.0, 1.0]


def test_a_logs_row_holds_until_the_next() -> None:
    log = Source("log", SWITCHED)
    assert log.spans(SWITCHED["valve"] > 0.5) == [(0.0, 1.0), (2.0, 3.0)]
    assert log.held("valve").tolist() == [1.0, 0.0, 1.0, 1.0]


@pytest.mark.parametrize(
    ("name", "kind", "plan"),
    [
        ("trajectory.csv", None, True),
        ("trajectory.csv", "robot", False),
        ("log.csv", None, False),
        ("log.csv", "plan", True),
        ("simulation.csv", None, False),
    ],
)
def test_metadata_then_the_file_name_tell_plans_from_logs(
    name: str, kind: str | None, plan: bool, tmp_path: Path
) -> None:
    meta = {"kind": kind} if kind else {}
    Trajectory([0.0, 1.0], {"body/z [m]": [0.2, 0.3]}, meta).write(tmp_path / name)
    assert load_source(tmp_path / name).plan is plan


def test_runs_are_named_by_their_folders(tmp_path: Path, jump: Callable[..., Trajectory]) -> None:
    for name in ("one/trajectory.csv", "one/simulation.csv", "logs/b.csv", "more/b.csv"):
        jump(5).write(tmp_path / name)
    paths = [tmp_path / "one", tmp_path / "one/simulation.csv", tmp_path / "logs/b.csv"]
    sources = load_sources(paths)
    assert [source.name for source in sources] == ["one", "one simulation", "b"]
    twice = load_sources([tmp_path / "logs/b.csv", tmp_path / "more/b.csv"])
    assert len({source.name for source in twice}) == 2
    assert default_path(sources[:1]) == tmp_path / "one/figure.png"
    assert default_path(sources[2:]) == tmp_path / "logs/b.png"
    assert default_path(sources) == tmp_path / "one/overlay.png"


def test_bench_logs_are_known_by_their_columns() -> None:
    assert Source("b", Trajectory(np.arange(2.0), {"piston/x [m]": np.zeros(2)})).bench
    assert not Source("r", Trajectory(np.arange(2.0), {"front/piston/x [m]": np.zeros(2)})).bench


def test_what_cannot_be_loaded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("runs/a").mkdir(parents=True)
    with pytest.raises(KembaError, match=r"runs/a: has no trajectory.csv; a run folder or a log"):
        load_source("runs/a")
    Path("runs/a/trajectory.csv").write_text("time [s],body/z [m]\n0,1\n")
    with pytest.raises(KembaError, match=r"none: no such file or folder; .*; runs here: runs/a$"):
        load_source("none")
    with pytest.raises(KembaError, match="one row only"):
        load_source("runs/a")
