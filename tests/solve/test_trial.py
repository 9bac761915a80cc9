"""Which of several trials is given."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from kemba.ocp.certificate.status import Status
from kemba.solve import trial as modules
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


@pytest.mark.parametrize(
    ("lags", "replays", "good", "said"),
    [(True, True, False, True), (True, False, False, False), (False, True, False, False),
     (True, True, True, False)],
)  # fmt: skip
def test_first_order_air_is_blamed_where_the_plan_is_right_and_falls(
    lags: bool, replays: bool, good: bool, said: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a plant of physical chambers, of a plan that is true on its own model."""
    silent = {"another_robot": None, "lacking": [], "carried_over": [], "sentence_of": "done"}
    for name, value in silent.items():
        monkeypatch.setattr(modules, name, lambda *_, value=value: value)
    monkeypatch.setattr(modules, "with_lags", lambda _: None if lags else object())
    monkeypatch.setattr(modules, "load_spec", lambda _: SimpleNamespace(chambers="orifice"))
    monkeypatch.setattr(
        modules, "_unconfirmed", lambda found, why, names: {"sentence": "; ".join([why, *names])}
    )
    task = SimpleNamespace(model="planning", plant="full", payload=0.0)
    plan: Any = SimpleNamespace(task=task, model=None)
    done: Any = SimpleNamespace(
        replays=replays, good=good, truth=SimpleNamespace(on="full"), band=None, feedback=None,
        remarks=[], causes=["it falls"],
    )  # fmt: skip
    one = Trial(plan, {}, Motions(), done)
    assert (modules.AIR in modules._confirmed(one, done)["sentence"]) is said
    assert one.leans_on_air is said
