"""Parts of a policy that make executions fail are not kept."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from kemba.errors import KembaError
from kemba.scenarios import feedback
from kemba.scenarios.feedback import policy_of, words_of
from kemba_cli.main import app


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("feedback") / "run"
    words = ["solve", "drop.yaml", "--set", "nodes=40", "--no-figure", "-q", "--out", str(folder)]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    return folder


@pytest.mark.parametrize(
    ("found", "kept", "tried"),
    [
        ({"edges and hips": (4, 4)}, (True, True), 1),
        ({"edges and hips": (3, 4), "edges": (4, 4)}, (True, False), 2),
        ({"edges and hips": (4, 1), "edges": (3, 1), "hips": (4, 2), "neither": (2, 2)},
         (False, True), 4),
        ({"edges and hips": (1, 1), "edges": (2, 2), "hips": (1, 1), "neither": (4, 3)},
         (False, False), 4),
    ],
    ids=["both", "edges", "hips", "neither"],
)  # fmt: skip
def test_the_parts_with_which_most_executions_come_out_are_kept(
    run: Path,
    monkeypatch: pytest.MonkeyPatch,
    found: dict[str, tuple[int, int]],
    kept: tuple[bool, bool],
    tried: int,
) -> None:
    (run / "policy.npz").unlink(missing_ok=True)
    monkeypatch.setattr(feedback, "_tried", lambda run, model, file, way, cases: found[way])
    monkeypatch.setattr(feedback, "TRIED", 4)
    file = policy_of(run)
    with np.load(file) as data:
        assert (bool(data["edge_gain"].any()), bool(data["hip_gains"].any())) == kept
        assert len(data["tried"]) == tried
    first, last = found["edges and hips"]
    assert f"of 4 executions succeed, and end in place: edges and hips {first} and {last}" in (
        words_of(file)
    )


def test_a_policy_is_made_once_and_succeeds_where_it_says(
    run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (run / "policy.npz").unlink(missing_ok=True)
    monkeypatch.setattr(feedback, "TRIED", 4)
    file = policy_of(run)
    made = file.stat().st_mtime_ns
    assert policy_of(run / "controller.csv") == file and file.stat().st_mtime_ns == made
    with np.load(file) as data:
        assert max(data["succeeded"]) == 4, "the shipped drop lands with or without feedback"
        assert (data["ended"] <= data["succeeded"]).all()


def test_a_run_without_a_table_says_so(run: Path, tmp_path: Path) -> None:
    for name in ("manifest.json", "task.yaml"):
        shutil.copy(run / name, tmp_path)
    with pytest.raises(KembaError, match="has no controller"):
        policy_of(tmp_path)
