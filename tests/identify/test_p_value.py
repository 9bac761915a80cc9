"""Is the p-value of nothing what it says? On machines that differ as a discovery believes.

On a linear problem nothing stands between them and the test but the test itself.
benchmarks/calibration.py asks the same of bench logs of the twin.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import kstest
from toy_problem import EFFECTS, Toy

from kemba.identify.answer import Answer
from kemba.identify.discover import _best_gain, discover
from kemba.identify.evidence.spike_slab import SpikeSlabSettings

MACHINES = 200
SIZE = 10.0  # N; the size of every effect of the toy


def machine(seed: int, missing: bool = False) -> dict[str, float]:
    """Figures off within their tolerance, every effect there with a small share of its size; one
    is of about its full size where something is missing."""
    rng, prior = np.random.default_rng([seed, 1]), SpikeSlabSettings.current()
    share, small = rng.choice(prior.tolerances), prior.spike * SIZE
    z = rng.standard_normal(len(EFFECTS) + 2)
    truth = {f"{name}.a": small * size for name, size in zip(EFFECTS, z[2:], strict=True)}
    truth["drag.a"] = abs(truth["drag.a"])
    if missing:
        name = ("kick", "wave", "hum", "ramp")[seed % 4]
        truth[f"{name}.a"] = SIZE * rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.5)
    return {**truth, "gain": 1.0 + 0.02 * share * z[0], "slope": 0.5 * share * z[1]}


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
        truth = machine(seed, missing=True)
        answer = discover(Toy(truth, seed)).answer
        inside += held(answer, truth)
    assert len(inside) >= 0.9 * MACHINES
    assert 0.93 <= np.mean(inside) <= 0.97


def held(answer: Answer, truth: dict[str, float]) -> list[bool]:
    """Whether the interval of the first effect holds the truth; none where nothing is named."""
    if answer.verdict != "missing":
        return []
    first = answer.ranking[0]
    value = first.parameters["a"]
    return [bool(value.low <= truth[f"{first.effect}.a"] <= value.high)]


def search(**gains: float) -> Any:
    """A finished search: evidence by effects, as a_b for two together."""
    points = {tuple(name.split("_")): gain for name, gain in gains.items()} | {(): 0.0}
    return SimpleNamespace(points={h: SimpleNamespace(log_evidence=g) for h, g in points.items()})


def test_the_best_of_the_pairs_does_not_count_as_one_effect() -> None:
    """The simulated logs are searched for single effects only."""
    assert _best_gain(search(a=2.0, b=3.0, a_b=30.0)) == 3.0
    assert _best_gain(search(a_b=30.0)) == 30.0  # nothing else was refitted
    assert _best_gain(search()) == 0.0
