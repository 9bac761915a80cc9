"""Run folders."""

import json
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from kemba.errors import KembaError
from kemba.files import atomic_text, sha256, write_json
from kemba.runs import RunFolder, load_run
from kemba.trajectory import Trajectory


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_a_run_from_start_to_end() -> None:
    Path("jump.yaml").write_text("height: 0.5 m\n")
    folder = RunFolder.create(None, "jump", ["jump.yaml"], ["kemba-opt", "solve", "jump.yaml"])
    running = json.loads((folder / "manifest.json").read_text())
    assert folder.path == Path("runs/jump-1")
    assert (running["status"], running["finished"]) == ("running", None)
    assert running["inputs"] == {"jump.yaml": sha256("jump.yaml")}
    assert running["command"] == ["kemba-opt", "solve", "jump.yaml"]
    assert set(running["versions"]) == {"kemba", "python", "casadi", "pin", "numpy"}

    Trajectory([0.0, 1.0], {"body/z [m]": [0.2, 0.5]}).write(folder / "trajectory.csv")
    write_json(folder / "certificate.json", {"status": "solved"})
    folder.finish("solved", seconds=np.float64(1.5))

    run = load_run("runs/jump-1")
    assert (run.manifest["status"], run.manifest["seconds"]) == ("solved", 1.5)
    assert datetime.fromisoformat(run.manifest["finished"]).tzinfo is not None
    assert run.trajectory["body/z"][-1] == 0.5
    assert run.certificate == {"status": "solved"}
    assert load_run("runs/jump-1/trajectory.csv").path == run.path


def test_numbers_count_up() -> None:
    paths = [RunFolder.create(None, "jump").path.name for _ in range(3)]
    assert paths == ["jump-1", "jump-2", "jump-3"]


def test_finished_runs_are_kept() -> None:
    RunFolder.create("out", "jump")
    RunFolder.create("out", "jump").finish("solved")  # the first one never finished
    with pytest.raises(KembaError, match=r"^out: holds a finished run already; give another"):
        RunFolder.create("out", "jump")


def test_a_folder_that_an_error_left_is_used_again() -> None:
    RunFolder.create("out", "jump").finish("failed")  # no plan was judged
    folder = RunFolder.create("out", "jump")
    (folder / "certificate.json").write_text("{}")
    folder.finish("failed")
    with pytest.raises(KembaError, match=r"^out: holds a finished run already; give another"):
        RunFolder.create("out", "jump")


def test_other_folders_are_left_alone() -> None:
    Path("data").mkdir()
    Path("data/thesis.tex").write_text("")
    with pytest.raises(KembaError, match=r"^data: holds other files; a new folder"):
        RunFolder.create("data", "jump")
    with pytest.raises(KembaError, match=r"^data/thesis.tex: is a file; a new folder"):
        RunFolder.create("data/thesis.tex", "jump")


def test_missing_runs_and_results() -> None:
    with pytest.raises(KembaError, match="nowhere: no such run folder; make one with: kemba-opt"):
        load_run("nowhere")
    RunFolder.create(None, "jump").finish("interrupted")
    with pytest.raises(KembaError, match="nowhere: no such run folder; runs here: runs/jump-1"):
        load_run("nowhere")
    with pytest.raises(KembaError, match="runs: is not a run folder"):
        load_run("runs")
    with pytest.raises(
        KembaError, match=r"has no trajectory.csv; the run's status is 'interrupted"
    ):
        _ = load_run("runs/jump-1").trajectory


def test_a_finished_run_is_replaced_only_by_force_and_never_its_logs() -> None:
    old = RunFolder.create("mine", "jump")
    (old / "plant.csv").write_text("of the old plan")
    old.finish("solved")
    with pytest.raises(KembaError, match="or --force to replace it"):
        RunFolder.create("mine", "jump")
    new = RunFolder.create("mine", "jump", force=True)
    assert [path.name for path in sorted(new.path.iterdir())] == [".lock", "manifest.json"]
    new.finish("solved")
    (new / "logs").mkdir()
    (new / "logs" / "log-1.csv").write_text("measured")
    with pytest.raises(KembaError, match="they belong to the run that is there"):
        RunFolder.create("mine", "jump", force=True)
    Path("other").mkdir()
    Path("other", "thesis.tex").write_text("mine")
    with pytest.raises(KembaError, match="holds other files"):
        RunFolder.create("other", "jump", force=True)


def test_json_takes_numpy_and_refuses_nothing() -> None:
    data = {"a": np.float32(0.5), "b": np.arange(2), "c": np.nan, "d": [np.inf], "e": Path("x")}
    write_json("x.json", data | {"f": np.bool_(True)})
    read = json.loads(Path("x.json").read_text())
    assert read == {"a": 0.5, "b": [0, 1], "c": None, "d": [None], "e": "x", "f": True}


def test_an_interrupted_write_changes_nothing() -> None:
    Path("x.txt").write_text("old")
    with pytest.raises(KeyboardInterrupt), atomic_text("x.txt") as stream:
        stream.write("new")
        raise KeyboardInterrupt
    assert Path("x.txt").read_text() == "old"
    assert [path.name for path in Path().iterdir()] == ["x.txt"]
