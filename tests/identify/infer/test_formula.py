"""How much evidence the best of many formulas needs before it is more than chance."""

from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
from scipy.signal import lfilter
from toy_problem import Toy

from kemba.identify.infer import formula
from kemba.identify.infer.formula import by_chance, look
from kemba.identify.infer.linear import NULL
from kemba.identify.infer.search import Search
from kemba.identify.infer.significance import RARE, NullTest


@pytest.mark.parametrize("width", [0.3, 1.0, 10.0])
def test_the_best_of_many_absent_terms_passes_less_often_than_a_p_value(width: float) -> None:
    """Columns of unit noise under a prior of `width` sigma: the log Bayes factor is known."""
    rng = np.random.default_rng(3)
    z = rng.standard_normal((20_000, 36))
    gain = 0.5 * z**2 * width**2 / (1.0 + width**2) - 0.5 * np.log(1.0 + width**2)
    false = np.mean(gain.max(axis=1) > by_chance(36))
    assert false <= RARE


def test_a_stricter_p_value_asks_for_more() -> None:
    usual = by_chance(36)
    with patch("kemba.identify.infer.formula.RARE", 0.01):
        assert by_chance(36) == pytest.approx(usual + np.log(2.0))
    assert by_chance(72) == pytest.approx(usual + np.log(2.0))


def test_slow_noise_is_taken_for_a_formula_less_often(monkeypatch: pytest.MonkeyPatch) -> None:
    """Noise that lasts for 10 ms: terms gain more by it than the best of as many may by chance."""
    searches = [searched(seed) for seed in range(40)]
    found = sum(look(search, NULL) is not None for search in searches)
    careless = NullTest(np.zeros(10), 200)
    monkeypatch.setattr(formula, "bootstrap", lambda *arguments: careless)
    alarms = sum(look(search, NULL) is not None for search in searches)
    assert alarms >= 6 and found <= alarms // 2


def test_a_term_of_less_force_than_every_model_leaves_is_no_formula(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A fifth of a usual friction is what every model leaves; the same term counts where it is
    more."""
    careless = NullTest(np.zeros(10), 200)
    monkeypatch.setattr(formula, "bootstrap", lambda *arguments: careless)
    search = next(s for s in map(searched, range(40)) if look(s, NULL) is not None)
    found = look(search, NULL)
    assert found is not None
    largest = max(abs(c) for c, _ in found.coefficients)
    for share, kept in ((0.19, False), (0.21, True)):
        monkeypatch.setattr(search.problem, "weight", lambda *_, w=share / largest: w)
        assert (look(search, NULL) is not None) == kept


def searched(seed: int) -> Search:
    """The search on logs of the toy in which nothing is missing."""
    toy, rng, keep = Toy({}, seed), np.random.default_rng(seed), 0.9
    white = np.sqrt(1.0 - keep**2) * rng.standard_normal(len(toy.measured))
    toy.measured += lfilter([1.0], [1.0, -keep], white)
    search = Search(toy)
    search.start()
    return search


@pytest.mark.parametrize(("nearly", "found"), [(-1.0, False), (1.0, True)])
def test_a_formula_gains_more_over_the_catalogues_answer_than_chance_gives(
    monkeypatch: pytest.MonkeyPatch, nearly: float, found: bool
) -> None:
    """The catalogue's answer is `nearly` nats further from it than the best of as many terms."""
    careless = NullTest(np.zeros(10), 200)
    monkeypatch.setattr(formula, "bootstrap", lambda *arguments: careless)
    search = next(s for s in map(searched, range(40)) if look(s, NULL) is not None)
    alone = look(search, NULL)
    assert alone is not None
    null = search.points[NULL]
    least = by_chance(len(search.problem.formulas(null.fit.theta)))
    evidence = null.log_evidence + alone.gain - least - nearly
    search.points["kick",] = replace(null, score=replace(null.score, log_evidence=evidence))
    assert (look(search, ("kick",)) is not None) == found
