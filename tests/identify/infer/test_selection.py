"""How many effects an answer names: those that left-out data need, and no more."""

import numpy as np
import pytest
from toy_problem import Toy

from kemba.identify.discover import discover
from kemba.identify.infer.cross_validation import Gain, left_out, left_out_error
from kemba.identify.infer.joint import JointFit
from kemba.identify.infer.linear import NULL, Hypothesis
from kemba.identify.infer.search import Search
from kemba.identify.infer.selection import (
    Selection,
    _thin,
    certain,
    likeliest_part,
    material,
    overclaimed,
    selected,
    simplest,
    that_show,
)
from kemba.identify.infer.verdict import caveats_of, equivalents, verdict_on


def windowed(truth: dict[str, float], seed: int = 0, artefact: float = 0.0) -> Toy:
    """A toy judged over 20 rows. `artefact`: size of an error that changes sign from row to row, as
    `wave` now does: nothing that lasts."""
    problem = Toy(truth, seed)
    problem.window = 20
    problem._shapes["wave"] = np.where(np.arange(len(problem.measured)) % 2, 1.0, -1.0)
    problem.measured = problem.measured + artefact * problem._shapes["wave"]
    return problem


def searched(problem: Toy, *best: str) -> Search:
    search = Search(problem)
    search.start()
    for size in range(1, len(best) + 1):
        search.visit(tuple(sorted(best[:size])))
    return search


def test_nats_that_do_not_last_name_no_effect() -> None:
    """The rows are sure of the wave, in every block; what is left after 20 rows is not."""
    problem = windowed({"kick.a": 9.0}, artefact=4.0)
    search = searched(problem, "kick", "wave")
    gain = left_out(search, ("kick", "wave"), ("kick",))
    assert gain.pays and gain.nats > 1000.0
    alone, both = (left_out_error(search, h) for h in (("kick",), ("kick", "wave")))
    assert abs(alone - both) < 0.01
    answer = discover(problem).answer
    assert (answer.verdict, answer.added) == ("missing", ("kick",))
    assert answer.ranking[0].probability > 0.95
    assert any("wave would fit these readings better" in remark for remark in answer.remarks)


def test_an_effect_that_left_out_data_need_stays_however_small() -> None:
    search = searched(windowed({"kick.a": 9.0, "bend.a": 3.0}), "kick", "bend")
    selection = Selection(("bend", "kick"), 0.01)
    assert simplest(search, selection) == selection


def test_what_is_dismissed_leaves_no_rivals() -> None:
    """They were rivals of the larger answer."""
    left = Selection(("hum", "kick"), 0.01, rivals=(("wave",),)).without(("hum", "kick"), ("kick",))
    assert (left.best, left.rivals) == (("kick",), ())
    assert left.dismissed == {("hum", "kick")}


def test_a_larger_answer_with_an_effect_that_was_left_out_is_no_rival() -> None:
    """Windows do not show the wave, which is left out, but a hum beside it."""
    search = searched(windowed({"kick.a": 9.0, "hum.a": 3.0}, artefact=4.0), "kick", "wave", "hum")
    found = simplest(search, Selection(("kick", "wave"), 0.01))
    assert found.best == ("kick",) and ("hum", "kick", "wave") in found.dismissed
    search.visit(("hum", "kick"))
    earlier = Selection(("kick", "wave"), 0.01, frozenset({("hum", "kick", "wave")}))
    assert ("hum", "kick") in simplest(search, earlier).dismissed


@pytest.mark.parametrize(("rows", "too_much"), [(-1.0, True), (1.0, False), (5.0, True)])
def test_a_larger_answer_must_gain_in_left_out_rows_but_not_only_there(
    rows: float, too_much: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its windows gain 0 nats, with a standard error of 2.3."""
    doubt = "kemba.identify.infer.selection"
    monkeypatch.setattr(f"{doubt}.left_out", lambda *of: Gain(rows, abs(rows)))
    monkeypatch.setattr(f"{doubt}.window_gain", lambda *of: Gain(0.0, 2.3))
    search = Search(windowed({"kick.a": 9.0}))
    assert overclaimed(search, ("kick",), ("bend", "kick")) is too_much


def test_parts_that_were_refitted_on_the_way_up_count(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kemba.identify.infer.selection._thin", lambda search, best: None)
    many = ("bend", "hum", "kick", "wave")
    search = searched(windowed({"kick.a": 9.0}), "kick", "bend", "hum", "wave")
    assert simplest(search, Selection(many, 0.01)).best == ("kick",)


def test_an_answer_of_many_effects_is_compared_with_its_parts_and_not_with_nothing() -> None:
    search, many = Search(windowed({"kick.a": 9.0})), ("hum", "kick", "wave")
    search.start()
    search.visit(many)
    part = likeliest_part(search, many)
    assert len(part) == 2 and "kick" in part
    assert {("hum", "kick"), ("hum", "wave"), ("kick", "wave")} < set(search.points)
    assert likeliest_part(search, ("kick",)) == NULL


def test_effects_that_do_not_pay_leave_an_answer_one_by_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As after a search that began anew with many effects: none of its parts was refitted."""

    def alone_pays(search: Search, hypothesis: Hypothesis, against: Hypothesis = NULL) -> Gain:
        return Gain(100.0, 200.0 if len(hypothesis) > 1 else 10.0)

    many = ("hum", "kick", "wave")
    search = Search(windowed({"kick.a": 9.0, "hum.a": 3.0, "wave.a": 3.0}))
    search.start()
    search.visit(many)
    monkeypatch.setattr("kemba.identify.infer.selection.left_out", alone_pays)
    assert selected(search, many, p_value=0.0).best == ("kick",)


def test_rivals_that_left_out_data_cannot_tell_are_named() -> None:
    """Evidence is far ahead for one of two, by what does not last: the answer is not sure of it."""
    problem = windowed({"drag.a": 9.0}, seed=1)
    flicker = np.tile([1.0, -1.0, -1.0, 1.0], len(problem.measured) // 4)
    problem._shapes["twin"] = problem._shapes["twin"] + 0.02 * flicker
    problem.measured = problem.measured - 0.3 * flicker
    search = searched(problem, "drag", "twin")
    best = ("drag", "twin")
    found = simplest(search, Selection(best, 0.01))
    assert found.best == ("drag",) and found.rivals == (("twin",),)
    assert best in found.dismissed and found.remarks
    nats = search.points["drag",].log_evidence - search.points["twin",].log_evidence
    assert nats > 10.0
    caveats = caveats_of(search, found, None)
    assert verdict_on(found.best, None, caveats) == "partly"
    assert equivalents(search, found, "drag") == ("twin",)


@pytest.mark.parametrize("seed", [0, 1, 5])
def test_a_small_gain_that_lasts_stays_though_it_is_within_its_scatter(seed: int) -> None:
    """A small bend: windows gain what the rows do, and the answer leaves nothing but noise."""
    search = searched(windowed({"kick.a": 9.0, "bend.a": 0.15}, seed), "kick", "bend")
    gain = left_out(search, ("bend", "kick"), ("kick",))
    assert 0.0 < gain.nats < gain.error
    selection = Selection(("bend", "kick"), 0.01)
    assert simplest(search, selection) == selection


@pytest.mark.parametrize(("lower", "named"), [(0.1, ("hum", "kick")), (-0.1, ("kick",))])
def test_an_effect_whose_interval_holds_its_absence_is_not_sure(
    lower: float, named: Hypothesis
) -> None:
    problem = Toy({"kick.a": 9.0, "hum.a": 0.5})
    low, value, high = np.array([[8.0, lower], [9.0, 0.5], [10.0, 1.0]])
    joint = JointFit({}, ("kick.a", "hum.a"), value, low, high, np.eye(2))
    assert certain(Selection(("hum", "kick"), 0.01), joint, problem).best == named
    alone = Selection(("hum",), 0.01)
    assert certain(alone, joint, problem) == alone, "whether there is anything is asked elsewhere"


@pytest.mark.parametrize(("size", "written"), [(0.5, ("hum", "kick")), (0.01, ("kick",))])
def test_what_leaves_the_quoted_error_as_it_is_is_not_written(
    size: float, written: Hypothesis
) -> None:
    search, both = searched(Toy({"kick.a": 9.0, "hum.a": size}), "kick", "hum"), ("hum", "kick")
    large, small = (JointFit({}, ("hum.a",), *[np.array([x])] * 3, np.eye(1)) for x in (9.0, 0.0))
    assert that_show(search, ("kick",), both, large) == written
    assert that_show(search, ("kick",), both, small) == ("kick",)
    assert that_show(search, both, both, small) == both, "selected"


def test_an_effect_that_may_as_well_be_absent_is_not_material() -> None:
    search = searched(Toy({"kick.a": 9.0}), "kick", "wave")
    assert material(search, ("kick", "wave")) == ("kick",)


def test_an_answer_is_thinned_only_until_the_error_grows() -> None:
    search, many = (
        Search(Toy({"bend.a": 9.0, "hum.a": 9.0, "kick.a": 9.0})),
        ("bend", "hum", "kick"),
    )
    search.start()
    search.visit((*many, "wave"))
    _thin(search, (*many, "wave"))
    sizes = {len(h) for h in search.points if h}
    assert many in search.points and sizes == {4, 3, 2}
