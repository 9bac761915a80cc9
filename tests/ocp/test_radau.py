"""The collocation schemes: Radau IIA's order conditions, stage by stage and over a step."""

import math

import numpy as np
import pytest
from scipy.interpolate import pade

from kemba.ocp.phases.radau import RADAU3, RADAU5, RADAU9, Scheme

WAYS = [RADAU3, RADAU5, RADAU9]
SCHEMES = pytest.mark.parametrize("scheme", WAYS, ids=lambda scheme: f"{scheme.stages} stages")


@SCHEMES
def test_every_stage_integrates_polynomials_of_its_order(scheme: Scheme) -> None:
    """Collocation: sum_j A[i, j] c_j^k = c_i^(k+1) / (k+1) for k below the number of stages."""
    for power in range(scheme.stages):
        found = scheme.butcher @ scheme.points**power
        assert found == pytest.approx(scheme.points ** (power + 1) / (power + 1), abs=1e-14)


@SCHEMES
def test_the_last_stage_is_the_end_of_the_step(scheme: Scheme) -> None:
    """Stiffly accurate: constraints of the last stage hold at the node itself."""
    assert scheme.points[-1] == 1.0


@SCHEMES
def test_a_step_of_a_linear_equation_is_pades(scheme: Scheme) -> None:
    """y' = -k y: the stability function is the Pade approximation (s-1, s) of exp, L-stable."""
    for z in (-0.1, -3.0, -1e6):
        ones = np.ones(scheme.stages)
        inside = np.linalg.solve(np.eye(scheme.stages) - z * scheme.butcher, ones)
        growth = 1.0 + z * scheme.butcher[-1] @ inside
        taylor = [1.0 / math.factorial(k) for k in range(2 * scheme.stages)]
        above, below = pade(taylor, scheme.stages, scheme.stages - 1)
        assert growth == pytest.approx(above(z) / below(z), rel=1e-6, abs=1e-10)


def test_schemes_are_called_by_their_order() -> None:
    """2 stages - 1, as the weights of the last row integrate: t^k for k up to twice that less 2."""
    for scheme, order in ((RADAU3, 3), (RADAU5, 5), (RADAU9, 9)):
        weights = scheme.butcher[-1]
        errors = [weights @ scheme.points**k - 1.0 / (k + 1) for k in range(order + 1)]
        assert np.abs(errors[:-1]).max() < 1e-12 and abs(errors[-1]) > 1e-6
