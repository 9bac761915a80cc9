"""An effect that left-out data do not need is likely at best, and no model is written with it."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from kemba.effects import BY_KIND
from kemba.identify.answer import IDLE, Answer, Ranked, Value, phrase
from kemba.identify.bench.problem import bench_problem
from kemba.identify.evidence.search import Search
from kemba.identify.verdict import Doubts, is_idle, verdict_on
from kemba.model.spec import load_model
from kemba.trajectory import Trajectory

FRICTION = ("seal_friction",)


@pytest.mark.parametrize("force", [0.0, 8.0])  # N
def test_an_effect_that_is_not_there_gains_nothing_on_left_out_data(
    bench_log: Callable[..., Trajectory], force: float
) -> None:
    hidden = (BY_KIND["seal_friction"](F_c=force),)
    search = Search(bench_problem([bench_log(hidden, duration=1.2)], load_model(rig=True)))
    search.start()
    search.visit(FRICTION)
    assert is_idle(search, FRICTION) == (force == 0.0)


def test_such_an_effect_is_said_to_be_likely_only() -> None:
    assert verdict_on(FRICTION, None, Doubts((IDLE,), part=True, idle=True)) == "partly"
    friction = Ranked("seal_friction", 0.99, {"F_c": Value(1.0, 0.5, 1.5, "N")})
    answer = Answer("partly", ranking=(friction,), found=FRICTION, remarks=[IDLE])
    answer.error_before = answer.error_after = 1.09
    said = phrase(answer)
    assert said.startswith("Likely, but not sure: seal_friction (F_c = 1 N (0.5 to 1.5)).")
    assert IDLE in said and "explain" not in said
