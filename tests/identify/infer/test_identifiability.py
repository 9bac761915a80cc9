"""What logs can tell before anything is looked for: by slopes, it is what fits find afterwards."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from toy_problem import Toy

from kemba.identify.discover import discover, what_shows
from kemba.identify.infer.linear import NULL, Ranker
from kemba.identify.infer.search import Search
from kemba.identify.infer.significance import expected, null_test
from kemba.identify.preview import splitting_test


def prepared(problem: Toy) -> Search:
    search = Search(problem)
    search.start()
    return search


def ranker_of(search: Search) -> Ranker:
    return search.base.ranker(search.points[NULL].linear)


def test_twins_look_alike_and_are_named_so_before_and_after_the_search() -> None:
    told: list[str] = []
    answer = discover(Toy({"drag.a": 9.0}), say=told.append).answer
    assert [sorted(group) for group in answer.alike] == [["drag", "twin"]]
    said = [text for text in told if text.startswith("these logs would show 7 of 7 effects")]
    assert said[0].endswith("cannot tell apart drag and twin"), said
    assert "twin" in answer.ranking[0].equivalent_to or "drag" in answer.ranking[0].equivalent_to


def test_what_does_not_show_at_its_usual_size_is_no_twin_of_anything() -> None:
    problem = Toy({})
    for name in ("drag", "twin"):
        problem._shapes[name] = 1e-3 * problem._shapes[name]
    search = prepared(problem)
    found = what_shows(search, null_test(search))
    assert not {"drag", "twin"} & set(found.shown) and found.alike == []
    assert found.sentence == "these logs would show 5 of 7 effects at usual size"


def test_the_expected_evidence_is_what_fits_differ_by() -> None:
    """Half of what the other effect leaves of the squares, by least squares; what is known of all
    others before matters little where the noise is small beside them."""
    problem = Toy({})
    problem._shapes["twin"] = problem._shapes["drag"] + 0.02 * np.sin(130.0 * problem._time)
    nats = expected(ranker_of(prepared(problem)), ["drag", "twin"])
    others = [problem._shapes[e] for e in ("bend", "kick", "ramp", "wave", "twin")]
    known = np.column_stack([problem._u, problem._time, *others])
    drag = 10.0 * problem._shapes["drag"]  # of its usual size
    left = drag - known @ np.linalg.lstsq(known, drag, rcond=None)[0]
    assert nats[0, 1] == pytest.approx(0.5 * left @ left, rel=0.1)
    assert nats[1, 0] == nats[0, 1] and np.isinf(nats[0, 0])


def test_of_a_rig_of_ones_own_no_standard_test_is_known() -> None:
    twins = {name: SimpleNamespace(typical=dict) for name in ("axis_friction", "gear_friction")}
    problem: Any = SimpleNamespace(candidates=twins)
    found = splitting_test("pendulum_rig", problem, tuple(twins))
    assert found.sentence == "no standard test tells apart axis_friction and gear_friction"
    assert (found.test, found.nats, found.log_s) == ("", 0.0, 0.0), "as `--json` prints it"
