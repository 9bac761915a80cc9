"""Small effects beside a strong one: named where left-out data are predicted worse without them."""

from __future__ import annotations

import numpy as np
import pytest
from toy_problem import Toy

from kemba.identify.discover import discover
from kemba.identify.doubt.belief import material
from kemba.identify.doubt.cross_validation import left_out, left_out_error
from kemba.identify.doubt.wanting import fuller, is_asked, wanted
from kemba.identify.evidence.search import Search

BOTH = ("drag", "kick")  # sizes that matter are 10 N


def searched(truth: dict[str, float], more: int = 0) -> Search:
    search = Search(Toy(truth, more=more))
    search.start()
    search.visit(("kick",))
    search.visit(BOTH)
    return search


def test_a_small_effect_that_left_out_data_need_is_named() -> None:
    """Without it the model that is written would be wrong where the hum acts."""
    answer = discover(Toy({"kick.a": 9.0, "hum.a": 2.4})).answer
    assert (answer.verdict, set(answer.added)) == ("missing", {"hum", "kick"})


@pytest.mark.parametrize(("size", "found"), [(2.4, BOTH), (1.8, ("kick",))])
def test_what_would_not_matter_alone_is_not_named_beside_another(
    size: float, found: tuple[str, ...]
) -> None:
    search = searched({"kick.a": 9.0, "drag.a": size})
    assert material(search, BOTH) == found


@pytest.mark.parametrize(("size", "found"), [(2.8, BOTH), (2.4, ("kick",)), (0.0, ("kick",))])
def test_left_out_data_overrule_the_prior_and_not_the_evidence(
    size: float, found: tuple[str, ...]
) -> None:
    """Among many effects a second one is unlikely from the first: evidence for 2.8 N of drag does
    not make up for that, but is strong. For 2.4 N it is less than 5 nats."""
    search = searched({"kick.a": 9.0, "drag.a": size}, more=40)
    assert search.best() == ("kick",)
    assert fuller(search, ("kick",)) == found


def test_when_the_answer_is_due_nothing_is_refitted_for_a_small_effect() -> None:
    search = Search(Toy({"kick.a": 9.0, "drag.a": 2.4}))
    search.start()
    search.visit(BOTH)
    search.due = 0.0
    assert not wanted(search, BOTH, "drag", 0.24)
    assert ("kick",) not in search.points


def test_left_out_data_that_no_answer_explains_ask_for_nothing() -> None:
    """A step that no effect has: what imitates a part of it is not named for that."""
    problem = Toy({"kick.a": 9.0, "drag.a": 5.0})
    problem.measured = problem.measured + 4.0 * np.sign(problem.rows().time - 0.4)
    search = Search(problem)
    search.start()
    for hypothesis in (("kick",), BOTH):
        search.visit(hypothesis)
    assert left_out(search, BOTH, ("kick",)).pays
    assert left_out_error(search, BOTH) > 1.5
    assert not is_asked(search, BOTH, ("kick",))
