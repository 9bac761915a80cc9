"""Draws: the same for the same seed, within their spreads, evenly spread over them."""

import numpy as np
import pytest

from kemba.scenarios.draw import Spread, drawn, sample
from kemba.sweep.cases import SolveBlock
from kemba.units import read_si


def block(**more: object) -> SolveBlock:
    spread = {"low": "0.35 m", "high": "90 cm"}
    data = {"kind": "solve", "task": "jump.yaml", "vary": {"height": spread}, "cases": 20} | more
    return SolveBlock.model_validate(data)


def test_the_same_seed_gives_the_same_cases() -> None:
    assert sample(block(), "a", 1) == sample(block(), "a", 1)
    assert sample(block(), "a", 1) != sample(block(), "a", 2)
    assert sample(block(), "a", 1) != sample(block(), "b", 1)


@pytest.mark.parametrize("sampling", ["latin_hypercube", "random"])
def test_draws_stay_within_their_ends(sampling: str) -> None:
    drawn = [read_si(v["height"]) for v in sample(block(sampling=sampling), "a", 1)]
    assert all(unit == "m" and 0.35 <= number <= 0.9 for number, unit in drawn)


def test_a_latin_hypercube_hits_every_stratum_once() -> None:
    heights = np.array([read_si(v["height"])[0] for v in sample(block(), "a", 1)])
    strata = np.floor((heights - 0.35) / 0.55 * 20)
    assert sorted(strata) == list(range(20))


def test_each_point_of_the_grid_meets_the_same_draws() -> None:
    found = sample(block(grid={"method": ["penalty", "relaxation"]}), "a", 1)
    assert len(found) == 40
    first, second = ([v["height"] for v in half] for half in (found[:20], found[20:]))
    assert first == second
    assert {v["method"] for v in found[:20]} == {"penalty"}


def test_whole_numbers_include_both_ends() -> None:
    spread = Spread(low=1, high=3, whole=True)
    values = [drawn(spread, u) for u in (0.0, 0.34, 0.5, 0.99999)]
    assert values == [1, 2, 2, 3] and all(isinstance(value, int) for value in values)


def test_normal_draws() -> None:
    spread = Spread(mean="1 ms", sigma="0.5 ms")
    assert drawn(spread, 0.5) == "0.001 s"
    assert read_si(drawn(spread, 0.8413447))[0] == pytest.approx(0.0015, rel=1e-5)


def test_one_of_some_values() -> None:
    spread = Spread.model_validate(["0.7 MPa", "0.8 MPa"])
    assert [drawn(spread, u) for u in (0.2, 0.7)] == ["0.7 MPa", "0.8 MPa"]
