"""How far nominal figures are off is told by the figures alone, not by how logs begin."""

import numpy as np
import pytest

from kemba.identify.infer.linear import NULL, Linear, Ranker
from kemba.identify.problem.problem import Candidate, Parameter

SUPPLY = Candidate("supply", Parameter("k", size=0.1))


def gain(off: float, starts: int) -> float:
    """Evidence [nats] of a supply that is wrong, where a figure of 2 % looks `off` by so many
    sigmas and logs begin as expected in so many states."""
    known = ("gauge", *(f"start:P[{i}]" for i in range(starts)))
    names = (*known, SUPPLY.key)
    width = np.array([0.02, *np.full(starts, 2e5), 0.1])
    columns = np.diag(50.0 / width)
    columns[:, -1] = columns[:, 0]  # the data cannot tell the supply from its figure
    z = np.zeros(len(names))
    measured = columns[:, 0] * off * width[0]
    gram, slope = columns.T @ columns, -columns.T @ measured
    power = np.array([measured @ measured])
    linear = Linear(names, z, z, width, gram[None], slope[None], power, np.array([len(z)]))
    ranker = Ranker(linear, {SUPPLY.effect: SUPPLY}, known)
    return ranker.score((SUPPLY.effect,)).log_evidence - ranker.score(NULL).log_evidence


@pytest.mark.parametrize("off", [0.0, 2.6, 5.0])
def test_logs_that_begin_as_expected_are_no_reason_to_believe_a_figure(off: float) -> None:
    assert gain(off, starts=10) == pytest.approx(gain(off, starts=0), abs=1e-6)


def test_a_figure_that_is_far_off_still_is_one() -> None:
    assert gain(1.0, starts=4) < 0.0 < gain(5.0, starts=4)
