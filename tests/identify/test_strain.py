"""Nominal figures that the data move too far: the effect behind them is tried."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
from toy_problem import Toy

from kemba.identify.discover import discover
from kemba.identify.evidence.search import Search
from kemba.identify.evidence.spike_slab import NULL
from kemba.identify.evidence.strain import stand_ins
from kemba.identify.problem.problem import Array, Candidate, Parameter, Theta

RISE = 0.05  # s


class Slow(Toy):
    """The same with a rise, whose time is a nominal figure; the effect `slow` makes it longer."""

    def __init__(self, truth: Mapping[str, float], seed: int = 0) -> None:
        super().__init__({}, seed)
        self.nuisance |= {"rise": (1.0, 0.02)}
        self.candidates |= {"slow": Candidate("slow", Parameter("k", "1", 1.0, 0.25, 0.1))}
        self.measured = self.measured + self.residual(truth) - self.residual({})

    def _risen(self, theta: Theta) -> Array:
        rise = RISE * theta.get("rise", 1.0) * theta.get("slow.k", 1.0)
        return np.asarray(300.0 * (1.0 - np.exp(-self._time / rise)))

    def residual(self, theta: Theta, runs: Collection[int] | None = None) -> Array:
        return np.asarray(super().residual(theta, runs) + self._risen(theta))


def searched(truth: Mapping[str, float]) -> Search:
    search = Search(Slow(truth))
    search.first()
    return search


def test_figures_that_are_believed_call_no_effect() -> None:
    for truth in ({}, {"rise": 1.05}, {"kick.a": 9.0}):
        search = searched(truth)
        assert stand_ins(search.points[NULL], search.problem) == {}


def test_figures_that_are_not_believed_call_the_effect_that_is_like_them() -> None:
    search = searched({"slow.k": 1.15})
    (first, start), *_ = stand_ins(search.points[NULL], search.problem).items()
    assert first == ("slow",)
    assert start["rise"] == 1.0 and 1.05 < start["slow.k"] < 1.3
    assert first in search.points


def test_the_effect_is_named_and_the_figures_are_believed_again() -> None:
    found = discover(Slow({"slow.k": 1.15}))
    assert found.answer.added == ("slow",)
    theta = found.search.points[found.best].fit.theta
    assert abs(theta["rise"] - 1.0) < 0.03 and abs(theta["slow.k"] - 1.15) < 0.03
