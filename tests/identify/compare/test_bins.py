"""Bins of a comparison: p values of their errors, and q values over all of them."""

import numpy as np
import pytest
from scipy import stats

from kemba.identify.compare.bins import (
    BinSettings,
    ConditionBin,
    condition_bins,
    correlation_length,
    excess,
    false_discoveries,
)
from kemba.identify.compare.hints import Slopes, within_tolerance
from kemba.identify.infer.significance import NullTest
from kemba.identify.infer.windows import Windows, changes, rms
from kemba.identify.problem.problem import Rows


def binned(errors: list[np.ndarray]) -> list[ConditionBin]:
    """The bins of one channel per array of errors, in noise units."""
    count = [len(e) for e in errors]
    channel = np.repeat(np.arange(len(errors)), count)
    label = np.full(len(channel), "flight")
    names = tuple(f"c{i}" for i in range(len(errors)))
    n = len(channel)
    rows = Rows(np.zeros(n, int), channel, np.arange(n) / 1e3, label, label, names, np.ones(n))
    return list(condition_bins(rows, label, np.arange(n), np.concatenate(errors)))


def test_q_values_control_false_discoveries() -> None:
    """Benjamini and Hochberg (1995) by hand: of m sorted p values, min over j >= i of m p_j / j."""
    rng = np.random.default_rng(0)
    errors = [rng.normal(0.0, scale, 60) for scale in np.linspace(1.0, 1.6, 12)]
    p = np.array([excess(e) for e in errors])
    order = np.argsort(p)
    wanted = np.empty(12)
    worst = 1.0
    for rank in range(12, 0, -1):
        i = order[rank - 1]
        worst = min(worst, 12 * p[i] / rank)
        wanted[i] = worst
    found = [b.q_value for b in binned(errors)]
    assert found == pytest.approx(wanted, rel=1e-9)
    assert np.sum(p < 0.01) > np.sum(np.array(found) < 0.01), "else it controls nothing here"


def test_of_many_good_conditions_none_stands_out() -> None:
    """300 conditions of a model that is right to within what is tolerated."""
    rng = np.random.default_rng(1)
    most = BinSettings.tolerated
    found = binned([rng.normal(0.0, most, 40) for _ in range(300)])
    assert not any(b.significant for b in found)


def test_one_bad_condition_among_many_stands_out() -> None:
    rng = np.random.default_rng(2)
    errors = [rng.normal(0.0, 1.0, 40) for _ in range(100)]
    errors[17] *= 2.5
    assert [b.channel for b in binned(errors) if b.significant] == ["c17"]


def test_a_condition_of_too_few_windows_is_no_bin() -> None:
    rng = np.random.default_rng(3)
    assert [b.channel for b in binned([rng.normal(size=4), rng.normal(size=5)])] == ["c1"]


def test_a_p_value_is_never_zero() -> None:
    """Of 99 draws none is as good: as good as one in a hundred, no better is known."""
    test = NullTest(np.arange(99.0), 40)
    assert test.p_value(1000.0) == 0.01
    assert test.p_value(-1.0) == 1.0
    assert test.p_value(98.0) == 0.02  # as good as the best counts


def test_few_pieces_cannot_make_a_small_p_value() -> None:
    """Five pieces have sixteen noises, each with its mirror image."""
    few, enough = (NullTest(np.zeros(399), blocks) for blocks in (5, 7))
    assert few.p_value(1000.0) == 1 / 16 and few.too_short
    assert enough.p_value(1000.0) == 1 / 64 and not enough.too_short
    assert few.needed == 7


def test_the_threshold_is_the_quantile_of_the_draws() -> None:
    draws = np.arange(101.0) / 10
    assert NullTest(draws, 40).threshold == pytest.approx(9.8)
    assert NullTest(draws / 100, 40).threshold == 1.0, "less than a nat is nothing"


def test_one_moment_convicts_nobody() -> None:
    """The largest error does not count: a foot that lifts a moment early is no missing force."""
    calm = np.full(40, 0.5)
    calm[17] = 20.0
    assert excess(calm) > 0.5
    calm[18:23] = 20.0
    assert excess(calm) < 1e-6


def test_correlated_values_count_as_few() -> None:
    """Of y = phi y + noise a mean needs (1 + phi) / (1 - phi) times as many values."""
    rng = np.random.default_rng(4)
    white, y = rng.normal(size=200_000), np.zeros(200_000)
    for i in range(1, len(y)):
        y[i] = 0.8 * y[i - 1] + white[i]
    assert correlation_length(white) == pytest.approx(1.0, abs=0.05)
    assert correlation_length(y) == pytest.approx(9.0, rel=0.1)
    assert correlation_length(np.ones(5)) == 1.0


def test_slow_errors_need_a_longer_log() -> None:
    """The same errors, each repeated 50 times, say no more than once; white and slow noise mixed
    hide this from the correlation of neighbours."""
    rng = np.random.default_rng(5)
    slow = np.repeat(1.5 * rng.normal(size=12), 50)
    assert excess(slow + 0.5 * rng.normal(size=600)) > 1e-3
    assert excess(1.6 * rng.normal(size=600)) < 1e-9


@pytest.mark.parametrize(("off", "tolerable"), [(1.0, True), (6.0, False)])
def test_figures_may_be_off_by_their_tolerance_and_not_by_more(off: float, tolerable: bool) -> None:
    """The error itself is explained either way; what tells is how far the figure would be off."""
    rng = np.random.default_rng(6)
    by_figure = 5.0 * rng.normal(size=(4000, 1))
    known = Slopes((), np.zeros((4000, 0)), by_figure)
    left, q_value = within_tolerance(rng.normal(size=4000) + off * by_figure[:, 0], known)
    assert np.std(left) == pytest.approx(1.0, abs=0.05)
    assert (q_value > 0.01) is tolerable


@pytest.mark.parametrize(("q", "significant"), [(0.009, True), (0.011, False), (0.5, False)])
def test_one_false_discovery_in_a_hundred_is_allowed(q: float, significant: bool) -> None:
    assert ConditionBin("body/z", "flight", "00", "in", 2.0, q).significant == significant


def test_windows_are_in_units_of_noise() -> None:
    windows = Windows(np.array([0, 3]), np.array([2.0, 4.0]))
    assert windows.sums(np.array([1.0, 2.0, 3.0, 8.0])).tolist() == [3.0, 2.0]


def test_a_window_ends_with_its_condition() -> None:
    none = np.zeros(4, dtype=int)
    phase = np.array(["rest", "rest", "moving", "moving"])
    mode = np.array(["00", "00", "00", "10"])
    rows = Rows(none, none, np.arange(4.0), phase, mode, ("piston/F",), np.ones(4))
    assert changes(rows, np.full(4, "")).tolist() == [True, False, True, True]


def test_an_error_is_the_root_of_the_mean_square() -> None:
    assert rms(np.array([3.0, -4.0, 0.0, 0.0])) == 2.5


@pytest.mark.parametrize("count", [1, 2, 9, 40])
def test_false_discoveries_are_controlled_as_scipy_does(count: int) -> None:
    p = np.random.default_rng(count).uniform(size=count) ** 3
    assert false_discoveries(p) == pytest.approx(stats.false_discovery_control(p), rel=1e-15)
