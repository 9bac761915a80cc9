"""Where the plant does not keep to the table alone, a plan is played with its policy."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from kemba.files import read_json
from kemba.policy.player import Policy
from kemba.scenarios.feedback import words_of
from kemba.solve import feedback
from kemba.solve.trial import TrialOrder
from kemba_cli.main import app


def solved(folder: Path, late: str) -> int:
    """The exit code of a drop whose touchdown on the plant may err by so much: by its table alone
    it is 4.5 ms late there."""
    words = ["solve", "drop.yaml", "--set", "nodes=40", "--no-figure", "-q", "--out", str(folder)]
    return (
        CliRunner().invoke(app, [*words, "--set", f"tolerances.plant_touchdown={late}"]).exit_code
    )


def test_feedback_keeps_to_what_the_table_alone_misses(tmp_path: Path) -> None:
    assert solved(tmp_path / "run", "4 ms") == 0
    found = read_json(tmp_path / "run" / "certificate.json")
    assert found["status"] == "solved" and found["good"]
    assert "by controller.csv alone the simulated robot touches down" in found["sentence"]
    assert f"with feedback by {found['feedback']['by']} (policy.npz)" in found["sentence"]
    assert found["trials"][0].startswith("guess, ") and "misses" in found["trials"][0]
    errors = [abs(f["touchdown_error_s"]) for f in (found["feedback"], found["plant_replay"])]
    assert errors[0] < 4e-3 < errors[1]
    file = tmp_path / "run" / "policy.npz"
    assert Policy(file).x.shape == (18,)
    assert words_of(file).startswith(f"feedback by {found['feedback']['by']} (of 3 executions")


@pytest.mark.parametrize(
    ("late", "code"),
    [
        pytest.param("1 ms", 1, id="neither", marks=pytest.mark.slow),  # a minute
        pytest.param("25 ms", 0, id="table"),
    ],
)
def test_feedback_is_kept_only_where_it_decides(late: str, code: int, tmp_path: Path) -> None:
    assert solved(tmp_path / "run", late) == code
    found = read_json(tmp_path / "run" / "certificate.json")
    assert "feedback" not in found and not (tmp_path / "run" / "policy.npz").exists()


def test_the_best_trial_is_tried_with_feedback_even_where_time_is_over(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """And after the deadline no other one."""
    tried: list[float] = []

    def with_feedback(trial: Any, execution: TrialOrder) -> None:
        tried.append(trial.score)

    monkeypatch.setattr(feedback, "with_feedback", with_feedback)
    trials: Any = [SimpleNamespace(score=score) for score in (1.0, 3.0, 2.0)]
    assert feedback.first_with_feedback(trials, TrialOrder(), deadline=0.0) is None
    assert tried == [3.0]
    assert feedback.first_with_feedback(trials, TrialOrder(), deadline=np.inf) is None
    assert tried == [3.0, 3.0, 2.0, 1.0]
