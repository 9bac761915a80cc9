"""Which of several trials is given."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from kemba.ocp.certificate.status import Status
from kemba.solve.trial import Motions, Trial


def trial(status: Status, share: float, cost: float, replays: bool = False) -> Trial:
    """A trial that is not good, whose executions miss by `share`."""
    plan: Any = SimpleNamespace(status=status, objective=cost, start="guess")
    judged: Any = SimpleNamespace(replays=replays, share=share)
    return Trial(plan, {"good": False, "status": status}, Motions(), judged)


@pytest.mark.parametrize(
    ("better", "worse"),
    [
        (trial(Status.SOLVED, np.inf, 9.0), trial(Status.ACCEPTABLE, np.inf, 1.0)),
        (trial(Status.SOLVED, 5.0, 9.0, replays=True), trial(Status.SOLVED, 2.0, 1.0)),
        (trial(Status.SOLVED, 2.0, 9.0), trial(Status.SOLVED, 3.0, 1.0)),
        (trial(Status.SOLVED, np.inf, 1.0), trial(Status.SOLVED, np.inf, 9.0)),
    ],
    ids=["a refined plan that falls", "true on its own model", "misses less", "costs less"],
)
def test_of_two_trials_the_better_is_given(better: Trial, worse: Trial) -> None:
    assert max([worse, better], key=lambda one: one.score) is better
