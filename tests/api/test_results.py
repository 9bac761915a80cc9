"""Results of the library in one line, progress where a person watches, and adopting an answer."""

import io
from pathlib import Path

import numpy as np
import pytest

import kemba
import kemba.trajectory
from kemba.api.learning import Discovered
from kemba.api.planning import Planned
from kemba.errors import KembaError
from kemba.identify.answer import Answer
from kemba.identify.workflow import _searching
from kemba.stopwatch import silent, watched


def test_a_result_is_one_short_line() -> None:
    text = "solved: apex 0.480 m" + ", and more of it" * 30
    shown = repr(Planned(Path("run"), {"sentence": text, "good": True}))
    assert shown.startswith("Planned: solved: apex 0.480 m") and "\n" not in shown
    assert len(shown) < 180


@pytest.mark.parametrize("there", [True, False])
def test_progress_is_shown_where_someone_watches(
    there: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    screen = io.StringIO()
    monkeypatch.setattr(screen, "isatty", lambda: there)
    monkeypatch.setattr("sys.stderr", screen)
    monkeypatch.delitem(__import__("sys").modules, "ipykernel", raising=False)
    tell = watched()
    tell("fitting")
    assert screen.getvalue() == ("   0.0 s  fitting\n" if there else "")
    assert (tell is silent) is not there


def test_what_is_read_shows_itself_in_one_line(tmp_path: Path) -> None:
    log = kemba.trajectory.Trajectory(
        np.arange(3.0), {f"leg{i}/hip/q [rad]": np.zeros(3) for i in range(9)}
    )
    for thing, start in (
        (log, "Trajectory(3 rows, 2 s: leg0/hip/q [rad], leg1"),
        (kemba.load_task("jump.yaml"), "Task(jump: 0.7 s, 0.5 m high, 100 nodes, model planning)"),
        (kemba.load_model("planning"), "Model(planning: "),
    ):
        assert repr(thing).startswith(start), repr(thing)
        assert "\n" not in repr(thing) and len(repr(thing)) < 120


CELLS = """
from kemba.stopwatch import watched; watched()("fitting")
import kemba; kemba.load_task("jump.yaml")
from kemba.plotting.style import paper_figure; figure = paper_figure(1.0); figure
kemba.load_task("jmp.yaml")
kemba.plan("jump.yaml", heigth="0.4 m")
"""


@pytest.mark.slow
def test_what_a_user_of_a_notebook_sees(tmp_path: Path) -> None:
    """In a kernel: stages on the way, one line for a thing, one for a mistake."""
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    cells = [nbformat.v4.new_code_cell(text) for text in CELLS.strip().splitlines()]
    notebook = nbformat.v4.new_notebook(cells=cells)
    folder = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(notebook, allow_errors=True, resources=folder).execute()
    stage, thing, figure, *mistakes = [cell["outputs"][-1] for cell in notebook.cells]
    assert stage["name"] == "stderr" and stage["text"].endswith(" s  fitting\n")
    assert thing["data"]["text/plain"].startswith("Task(jump: ")
    assert "image/png" in figure["data"]
    for shown, near in zip(mistakes, ("jump.yaml", "height"), strict=True):
        assert f"did you mean '{near}'?" in shown["evalue"]
        assert len(shown["traceback"]) == 1 and "File" not in shown["traceback"][0]


def test_an_answer_without_a_folder_is_not_adopted(tmp_path: Path) -> None:
    with pytest.raises(KembaError, match="was not written to a folder"):
        kemba.adopt(Discovered(Answer("missing"), None), out=tmp_path / "model.yaml")
    with pytest.raises(KembaError, match=r"holds no answer\.json"):
        kemba.adopt(tmp_path, out=tmp_path / "model.yaml")
    (tmp_path / "model.yaml").touch()
    kept = r"model\.yaml: exists already; give another name, .* \(in Python: force=True\)"
    with pytest.raises(KembaError, match=kept):
        kemba.adopt(tmp_path, out=tmp_path / "model.yaml")
    with pytest.raises(KembaError, match=r"holds no answer\.json"):
        kemba.adopt(tmp_path, out=tmp_path / "model.yaml", force=True)


def test_a_search_leaves_time_for_the_end_of_its_answer() -> None:
    assert _searching(300.0, 5.0) == pytest.approx(270.0)
    told = "20 s are too short for these logs, of which nothing was fitted; about 36 s are needed"
    with pytest.raises(KembaError, match=told):
        _searching(20.0, 5.0)
    # of a round, of which half is for learning, the limit that was given is told
    with pytest.raises(KembaError, match=r"20 s are too short .* about 73 s are needed"):
        _searching(20.0, 5.0, 0.5)
