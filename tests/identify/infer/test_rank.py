"""Evidence, doubt and left-out data on a problem small enough to know the answer."""

import re

import numpy as np
import pytest
from toy_problem import Toy

from kemba.identify.answer import ENDED, HELD_OUT, Answer, Ranked, Value, Verdict, phrase
from kemba.identify.discover import Discovery, discover
from kemba.identify.infer.cross_validation import Gain, left_out, left_out_error
from kemba.identify.infer.linear import NULL, SpikeSlabSettings, probabilities
from kemba.identify.infer.search import Search
from kemba.identify.infer.selection import Selection, material
from kemba.identify.infer.verdict import caveats_of, values, verdict_on
from kemba.identify.workflow import _hold_against
from kemba.plotting.comparison import plot_ladder


def test_the_right_effect_is_named_with_its_value() -> None:
    answer = discover(Toy({"kick.a": 8.0})).answer
    assert answer.verdict == "missing" and answer.added == ("kick",)
    value = answer.ranking[0].parameters["a"]
    assert value.low < 8.0 < value.high
    assert answer.ranking[0].probability > 0.95
    assert answer.error_before > 3 * answer.error_after
    assert answer.error_after == pytest.approx(1.0, abs=0.1)


def test_twins_are_named_together() -> None:
    answer = discover(Toy({"drag.a": 8.0})).answer
    first = answer.ranking[0]
    assert {first.effect, *first.equivalent_to} >= {"drag", "twin"}
    assert first.probability < 0.95


def test_two_effects_are_both_found() -> None:
    answer = discover(Toy({"kick.a": -9.0, "wave.a": 7.0})).answer
    assert set(answer.added) == {"kick", "wave"}


def test_as_many_effects_are_found_as_the_data_carry() -> None:
    hidden = {"kick": -9.0, "wave": 7.0, "bend": 12.0, "hum": 6.0, "ramp": 8.0}
    answer = discover(Toy({f"{name}.a": size for name, size in hidden.items()})).answer
    assert answer.verdict == "missing" and set(answer.added) == set(hidden)
    for row in answer.ranking[:5]:
        value = row.parameters["a"]
        assert value.low < hidden[row.effect] < value.high
    assert answer.excess_after < 0.2 * answer.excess_before


def test_the_figure_of_an_answer_does_not_depend_on_what_is_refitted_later() -> None:
    found = discover(Toy({"kick.a": -9.0, "wave.a": 7.0}))
    del found.search.points["kick",]
    steps, unseen = zip(*found.answer.ladder, strict=True)
    plot_ladder(steps, found.fitted, unseen, "held-out runs")
    assert len(found.fitted) == len(found.answer.ladder)


def test_an_effect_beside_others_must_pay_on_left_out_data() -> None:
    """A hum in one half of one run: fitted to all it helps a little, and elsewhere it does harm."""
    problem = Toy({"kick.a": 9.0})
    first = problem.rows().run == 0
    first[np.flatnonzero(first)[400:]] = False
    problem.measured = problem.measured + 5.0 * problem._shapes["hum"] * first
    assert discover(problem).answer.added == ("kick",)


def test_nothing_is_found_when_nothing_is_missing() -> None:
    answers = [discover(Toy({}, seed)).answer for seed in range(12)]
    assert sum(a.verdict != "nothing" for a in answers) == 0
    assert all(a.p_value_nothing > 0.02 for a in answers)
    seen = answers[0].smallest_detectable["kick"]["a"]
    assert seen is not None and 0.5 < seen < 6.0


def test_an_effect_that_the_logs_cannot_show_has_no_detectable_size() -> None:
    problem = Toy({})
    problem._shapes["kick"] = 0.0 * problem._time
    sizes = discover(problem).answer.smallest_detectable
    assert sizes["kick"]["a"] is None and sizes["wave"]["a"] is not None


def test_a_small_imperfection_is_nothing() -> None:
    assert discover(Toy({"kick.a": 0.5, "bend.a": -0.5})).answer.verdict == "nothing"


def test_what_the_catalogue_lacks_is_unknown() -> None:
    problem = Toy({})
    problem.measured += 6.0 * np.sign(problem._time - 0.4)
    answer = discover(problem).answer
    assert answer.verdict == "unknown"
    assert answer.formula is not None and "step" in answer.formula


def test_what_is_sure_is_told_where_the_time_ends_the_search() -> None:
    truth = {"kick.a": 9.0, "wave.a": -6.0, "hum.a": 6.0}
    answer = discover(Toy(truth, seed=2), time_limit=0.0).answer
    assert answer.added == answer.sure == ("kick",)  # none was tried beside the first
    assert answer.verdict == "partly" and ENDED in answer.remarks
    whole = discover(Toy(truth, seed=2)).answer
    assert set(whole.added) == {"kick", "wave", "hum"} and ENDED not in whole.remarks
    single = discover(Toy({"kick.a": 9.0}, seed=2), time_limit=0.0).answer
    assert single.verdict == "missing" and ENDED in single.remarks


def test_probabilities_prefer_the_simpler_of_equals() -> None:
    found = probabilities({(): -100.0, ("a",): -50.0, ("a", "b"): -50.0}, count=10)
    assert sum(found.values()) == pytest.approx(1.0)
    assert found["a",] > 0.9 > found["a", "b"]


@pytest.mark.parametrize(
    ("noise", "size", "verdict"),
    [(5.0, 3.0, "unknown"), (5.0, 12.0, "partly"), (1.0, 3.0, "missing")],
    ids=["most is left", "much is left", "noise is left"],
)
def test_an_answer_that_leaves_much_of_the_error_is_not_the_whole(
    noise: float, size: float, verdict: str
) -> None:
    """A kick is there, and errors `noise` times as large as sensors have: the kick is a part of
    the answer where it explains more than a tenth of the error beyond the noise."""
    problem = Toy({"kick.a": size}, seed=4)
    rng = np.random.default_rng(5)
    problem.measured += np.sqrt(noise**2 - 1.0) * rng.standard_normal(len(problem.measured))
    found = caveats_of(searched(problem), Selection(("kick",)), None)
    assert verdict_on(("kick",), None, found) == verdict
    if verdict != "missing":
        (doubt,) = found.reasons
        left = re.fullmatch("kick fits best, but leaves an error of (.*) times the noise", doubt)
        assert left and float(left[1]) == pytest.approx(noise, rel=0.05)


@pytest.mark.parametrize(
    ("p_value", "noise", "verdict"),
    [
        (0.003, 2.0, "unknown"),
        (0.003, 1.2, "nothing"),
        (0.03, 2.0, "nothing"),
        (0.03, 3.0, "unknown"),  # too large for any chance
    ],
)
def test_a_significant_error_that_nothing_explains_is_not_called_small(
    p_value: float, noise: float, verdict: str
) -> None:
    problem = Toy({}, seed=4)
    problem.measured += np.sqrt(noise**2 - 1.0) * np.random.default_rng(5).standard_normal(
        len(problem.measured)
    )
    found = caveats_of(searched(problem), Selection(NULL, p_value), None)
    assert verdict_on(NULL, None, found) == verdict


@pytest.mark.parametrize(("split", "error"), [(HELD_OUT, "held-out error"), ("runs", "error")])
@pytest.mark.parametrize(
    ("after", "said"), [(0.91, "falls from 0.96 to 0.91"), (0.97, "was 0.96 and is 0.97")]
)
def test_the_sentence_says_falls_only_where_the_error_falls(
    after: float, said: str, split: str, error: str
) -> None:
    """And calls it held-out only where logs were kept aside."""
    found = Answer(
        "missing",
        ranking=[Ranked("payload", 1.0, {})],
        added=("payload",),
        sure=("payload",),
        error_before=0.96,
        error_after=after,
        split_by=split,
    )
    assert f"; the {error} {said} times the noise" in phrase(found)


def test_a_part_of_an_answer_says_what_it_explains_and_what_is_left() -> None:
    problem = Toy({"kick.a": 15.0})
    rng = np.random.default_rng(5)
    problem.measured += 4.0 * rng.standard_normal(len(problem.measured))
    answer = discover(problem).answer
    assert answer.verdict == "partly" and answer.added == ("kick",) == answer.sure
    assert answer.excess_before == pytest.approx(np.sqrt(answer.error_before**2 - 1.0))
    share = 1.0 - answer.excess_after / answer.excess_before
    assert f"explains {100 * share:.0f} % of the error beyond the noise" in answer.sentence
    assert answer.next and "Next: " in answer.sentence
    written = answer.json()
    assert written["excess_after"] == answer.excess_after and "100 %" in written["probabilities"]


def test_an_effect_that_has_a_rival_is_likely_and_not_sure() -> None:
    problem = Toy({"drag.a": 15.0})
    rng = np.random.default_rng(5)
    problem.measured += 4.0 * rng.standard_normal(len(problem.measured))
    answer = discover(problem).answer
    assert answer.verdict == "partly" and answer.added and not answer.sure
    assert "Likely, but not sure: " in answer.sentence and "kemba-opt experiment" in answer.sentence


def test_what_was_dismissed_has_no_probability() -> None:
    """Not even where it leads by so much that the others would vanish beside it."""
    search = Search(Toy({"kick.a": 80.0}))
    best = search.run()
    assert search.points[best].log_evidence - search.points[()].log_evidence > 1000
    dismissed = {h for h in search.points if "kick" in h}
    left = search.probabilities(dismissed)
    assert not dismissed & set(left)
    assert sum(left.values()) == pytest.approx(1.0)


def searched(problem: Toy) -> Search:
    search = Search(problem)
    search.start()
    search.visit(("kick",))
    return search


def test_an_effect_in_one_block_only_does_not_hold_on_the_others() -> None:
    """A kick in the first half of the first of three runs: fitted to all, it explains a little;
    told from the other five halves, that half is as it was, and the others get worse."""
    problem = Toy({})
    first = problem.rows().run == 0
    first[np.flatnonzero(first)[400:]] = False
    problem.measured = problem.measured + 8.0 * problem._shapes["kick"] * first
    search = searched(problem)
    gain = left_out(search, ("kick",))
    assert search.points["kick",].fit.theta["kick.a"] == pytest.approx(8.0 / 6, abs=0.4)
    assert gain.nats < -50.0, "it speaks against the effect"


def test_an_effect_in_every_block_holds_on_each() -> None:
    """Its gain is at least what the residuals say, (8 u v)^2 / 2 summed: the gain and the slope
    that stand in for it in other blocks err in this one."""
    problem = Toy({"kick.a": 8.0})
    search = searched(problem)
    gain = left_out(search, ("kick",))
    told = 0.5 * float(np.sum((8.0 * problem._shapes["kick"]) ** 2))
    assert gain.nats > 0.95 * told and not gain.refuted


def test_the_error_of_prediction_counts_what_the_fit_did_not_see() -> None:
    """Five effects and a gain free on noise alone: blocks that were seen have less error than the
    noise, left-out ones more."""
    found = [searched(Toy({}, seed)) for seed in range(6)]
    errors = [left_out_error(s, ("kick",)) for s in found]
    fitted = [np.sqrt(2 * s.points["kick",].fit.cost / 2400) for s in found]
    assert np.mean(errors) > np.mean(fitted)
    assert np.mean(errors) == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize("size", [3.0, 9.0])
def test_intervals_are_1_96_sigma_either_way(size: float) -> None:
    """Sigma of a kick by hand: noise over the regressor's length, and the share of its size by
    which models are imperfect anyway."""
    problem = Toy({"kick.a": size})
    found = discover(problem)
    value = values(found.search, ("kick",), "kick")["a"]
    noise = 1.0 / float(np.linalg.norm(problem._shapes["kick"]))
    sigma = np.hypot(noise, SpikeSlabSettings.spike * value.value)
    assert value.high - value.value == pytest.approx(1.96 * sigma, rel=0.05)
    assert value.value - value.low == pytest.approx(1.96 * sigma, rel=0.05)


@pytest.mark.parametrize(
    ("nats", "error", "refuted"), [(-3.0, 0.5, True), (-3.0, 1.5, False), (3.0, 0.5, False)]
)
def test_left_out_data_refute_by_more_than_their_scatter(
    nats: float, error: float, refuted: bool
) -> None:
    assert Gain(nats, error).refuted == refuted


@pytest.mark.parametrize(("size", "found"), [(1.5, ()), (3.0, ("kick",))])
def test_less_than_a_fifth_of_an_effects_size_is_no_finding(
    size: float, found: tuple[str, ...]
) -> None:
    """A kick of 15 % of its size is measured well, and no more than models are wrong by."""
    search = searched(Toy({"kick.a": size}))
    assert search.points["kick",].fit.theta["kick.a"] == pytest.approx(size, abs=0.1)
    assert material(search, ("kick",)) == found


def test_an_effect_that_explains_nothing_costs_evidence() -> None:
    """Occam: its prior is spread over sizes that the data exclude. Here by a factor of about 14
    (slab over spike width), 2.6 nats, less what noise brings by chance."""
    loss = []
    for seed in range(6):
        search = searched(Toy({}, seed))
        loss.append(search.points[()].log_evidence - search.points["kick",].log_evidence)
    assert 1.5 < np.mean(loss) < 3.5


def test_a_sentence_names_many_effects_and_leaves_tables_to_the_ranking() -> None:
    """Of an effect with many parameters only how many there are."""
    mass = Value(3.0, 2.0, 4.0, "kg")
    few, many = {"m": mass}, dict.fromkeys("abc", mass)
    ranking = [Ranked("payload", 1.0, few), Ranked("tubes", 1.0, many), Ranked("rope", 1.0, few)]
    found = Answer("missing", ranking=ranking, sure=("payload", "tubes", "rope"))
    named = f"payload (m = {mass}), tubes (3 parameters) and rope (m = {mass})"
    assert phrase(found).startswith(f"Missing: {named}; ")


@pytest.mark.parametrize(("before", "verdict"), [(1.2, "nothing"), (2.5, "unknown")])
def test_what_would_raise_the_quoted_error_is_not_written(before: float, verdict: str) -> None:
    """Of a model that explains the logs as it is, nothing is missing then."""
    found = Answer("missing", added=("payload",), error_before=before, error_after=3.0)
    found.drop_model()
    assert (found.verdict, found.writes, found.error_after) == (verdict, False, before)
    assert found.remarks[0] == f"payload would raise the quoted error from {before:.2f} to 3.00: " \
        "no model is written"  # fmt: skip


@pytest.mark.parametrize(
    ("verdict", "before", "after", "told"),
    [
        ("missing", 11.2, 1.4, "missing"),
        ("missing", 11.2, 6.8, "partly"),
        ("missing", 0.64, 0.64, "partly"),
        ("nothing", 2.3, 2.3, "nothing"),
        ("nothing", 4.2, 2.6, "unknown"),
    ],
)
def test_a_verdict_holds_by_the_error_that_is_quoted(
    verdict: Verdict, before: float, after: float, told: str
) -> None:
    """The search may have learnt a noise that forgets what changes slowly."""
    search = Search(Toy({"kick.a": 9.0}))
    search.run()
    answer = Answer(verdict, error_before=before, error_after=after)
    answer.added = ("kick",) if verdict == "missing" else ()
    _hold_against(Discovery(answer, search, answer.added))
    assert answer.verdict == told
    said = any(f"leaves an error of {after:g}" in r for r in answer.remarks)
    stays = f"the answer leaves the quoted error at {after:g} times the noise" in answer.remarks
    assert (said or stays, stays) == (told != verdict, before == after and verdict == "missing")
