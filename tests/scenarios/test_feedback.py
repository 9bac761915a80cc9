"""Parts of a policy that make executions fail are not kept."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from kemba.scenarios import feedback
from kemba.scenarios.feedback import TrialSettings, policy_of, words_of
from kemba.settings import changed
from kemba_cli.main import app


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("feedback") / "run"
    words = ["solve", "drop.yaml", "--set", "nodes=40", "--no-figure", "-q", "--out", str(folder)]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    return folder


@pytest.mark.parametrize(
    ("succeeded", "kept", "tried"),
    [
        ({"edges and hips": 4}, (True, True), 1),
        ({"edges and hips": 3, "neither": 4}, (False, False), 2),
        ({"edges and hips": 1, "neither": 2, "hips": 3, "edges": 2}, (False, True), 4),
    ],
    ids=["all", "neither", "hips"],
)
def test_the_parts_with_which_most_executions_succeed_are_kept(
    run: Path,
    monkeypatch: pytest.MonkeyPatch,
    succeeded: dict[str, int],
    kept: tuple[bool, bool],
    tried: int,
) -> None:
    (run / "policy.npz").unlink(missing_ok=True)
    monkeypatch.setattr(feedback, "executions_of", lambda run: [])
    monkeypatch.setattr(feedback, "_successes", lambda run, model, file, way, cases: succeeded[way])
    with changed(TrialSettings, count=4):
        file = policy_of(run)
    with np.load(file) as data:
        assert (bool(data["edge_gain"].any()), bool(data["hip_gains"].any())) == kept
        assert len(data["tried"]) == tried
    assert f"of 4 executions succeed: edges and hips {succeeded['edges and hips']}" in words_of(
        file
    )


def test_a_policy_is_made_once_and_succeeds_where_it_says(run: Path) -> None:
    (run / "policy.npz").unlink(missing_ok=True)
    with changed(TrialSettings, count=4):
        file = policy_of(run)
    made = file.stat().st_mtime_ns
    assert policy_of(run / "controller.csv") == file and file.stat().st_mtime_ns == made
    with np.load(file) as data:
        assert max(data["succeeded"]) == 4, "the shipped drop lands with or without feedback"
