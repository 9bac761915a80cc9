"""Is the p-value of nothing what it says? On machines that differ as a discovery believes.

On a linear problem nothing stands between them and the test but the test itself.
benchmarks/calibration.py asks the same of bench logs of the twin.
"""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import kstest, norm
from toy_problem import EFFECTS, Toy

from kemba.identify.discover import discover
from kemba.identify.infer.linear import NULL, SpikeSlabSettings
from kemba.identify.infer.search import Search
from kemba.identify.infer.selection import Selection, selected
from kemba.identify.infer.significance import (
    NullTest,
    best_gain,
    bootstrap,
    smallest_detectable,
)

MACHINES = 200
SIZE = 10.0  # N; the size of every effect of the toy


def machine(seed: int) -> dict[str, float]:
    """Figures off within their tolerance, every effect there with a small share of its size."""
    rng, prior = np.random.default_rng([seed, 1]), SpikeSlabSettings
    share, small = rng.choice(prior.tolerances), prior.spike * SIZE
    z = rng.standard_normal(len(EFFECTS) + 2)
    truth = {f"{name}.a": small * size for name, size in zip(EFFECTS, z[2:], strict=True)}
    truth["drag.a"] = abs(truth["drag.a"])
    return {**truth, "gain": 1.0 + 0.02 * share * z[0], "slope": 0.5 * share * z[1]}


def lacking(seed: int) -> tuple[dict[str, float], str, float]:
    """Such a machine whose model lacks an effect, its name and its size.

    The machine's imperfection adds to the effect or hides some: as much as an interval counts.
    """
    rng, prior = np.random.default_rng([seed, 2]), SpikeSlabSettings
    name = ("kick", "wave", "hum", "ramp")[seed % 4]
    size = SIZE * rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.5)
    there = size * (1.0 + prior.spike * rng.standard_normal())
    return machine(seed) | {f"{name}.a": there}, name, size


@pytest.mark.slow
def test_p_values_are_uniform_and_false_alarms_rare() -> None:
    answers = [discover(Toy(machine(seed), seed)).answer for seed in range(MACHINES)]
    p = np.array([answer.p_value_nothing for answer in answers])
    assert kstest(p, "uniform").pvalue > 0.05
    assert sum(answer.verdict != "nothing" for answer in answers) <= 0.03 * MACHINES


def test_where_every_effect_is_absent_the_test_is_careful() -> None:
    """Then less is there than the test allows for: p-values are large, not uniform."""
    p = [discover(Toy({}, seed)).answer.p_value_nothing for seed in range(20)]
    assert min(p) > 0.5


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    inside = []
    for seed in range(MACHINES):
        truth, name, size = lacking(seed)
        answer = discover(Toy(truth, seed)).answer
        assert answer.ranking[0].effect == name
        value = answer.ranking[0].parameters["a"]
        inside.append(value.low <= size <= value.high)
    assert 0.93 <= np.mean(inside) <= 0.97


def search(**gains: float) -> Any:
    """A finished search where the motion moves: evidence by effects, as a_b for two together."""
    points = {tuple(name.split("_")): gain for name, gain in gains.items()} | {(): 0.0}
    found = {h: SimpleNamespace(log_evidence=gain) for h, gain in points.items()}
    return SimpleNamespace(points=found, problem=SimpleNamespace(moves=True), thorough=False)


def test_the_best_of_the_pairs_does_not_count_as_one_effect() -> None:
    """The simulated logs are searched for single effects only."""
    assert best_gain(search(a=2.0, b=3.0, a_b=30.0)) == 3.0
    assert best_gain(search(a_b=30.0)) == 30.0  # nothing else was refitted
    assert best_gain(search()) == 0.0


def test_what_chance_does_as_often_is_not_believed() -> None:
    """The search names an effect; every simulated log looks better."""
    found = search(a=3.0)
    p_value = NullTest(np.full(99, 50.0), 40).p_value(best_gain(found))
    assert selected(found, ("a",), p_value) == Selection()


def test_a_detectable_size_is_seen_nine_times_in_ten() -> None:
    """The estimate then favours the effect over nothing by the threshold, but for its lowest
    tenth: a weak wave, of which data and spike leave about as much open."""
    problem, prior, threshold = Toy({}), SpikeSlabSettings, 4.0
    problem._shapes["wave"] = 0.05 * problem._shapes["wave"]
    search = Search(problem)
    search.start()
    ranker = search.base.ranker(search.base.point.mode.linear)
    size = smallest_detectable(ranker, threshold)["wave"]
    told = 1.0 / np.sum(problem._shapes["wave"] ** 2)  # variance of the estimate
    narrow, wide = (np.hypot(np.sqrt(told), w * SIZE) for w in (prior.spike, prior.slab))
    assert size is not None
    low = norm(size, narrow).ppf(0.1)
    assert norm(0, wide).logpdf(low) - norm(0, narrow).logpdf(low) == pytest.approx(4.0, abs=0.1)


def test_what_cannot_be_negative_is_positive_in_simulated_logs() -> None:
    """A drag of the size that every machine may have then speaks for drag by its sign as well; of
    its twin, which may be negative, no sign is expected."""
    search = Search(Toy({}))
    search.start()
    ranker = search.base.ranker(search.base.point.mode.linear)
    silent = np.zeros((40, len(ranker.linear.names)))
    drag, twin = (np.median(bootstrap(ranker, silent, [n]).scores) for n in ("drag", "twin"))
    assert drag > twin + 0.3


def test_what_simulated_logs_say_of_one_effect_is_what_the_ranking_says() -> None:
    """By one factor of all effects, or by a factor for each."""
    search = Search(Toy({"wave.a": 4.0, "drag.a": 2.0}))
    search.start()
    linear = search.base.point.mode.linear
    ranker = search.base.ranker(replace(linear, at=linear.mean))
    hypotheses = ((), *((effect,) for effect in EFFECTS))
    found, expected = [], []
    for tolerance in SpikeSlabSettings.tolerances:
        slopes = ranker._slope[:, None]
        found.append(ranker._beside(NULL, list(EFFECTS), slopes, tolerance)[:, 0])
        expected.append([ranker._score(h, tolerance).log_evidence for h in hypotheses])
    assert found - found[0][0] == pytest.approx(np.array(expected) - expected[0][0], abs=1e-6)
