"""The colour of the noise, learnt from what is left when every effect may help to explain."""

from __future__ import annotations

import numpy as np

from kemba.identify.evidence.linear import Linear, is_on, linearise, time_blocks
from kemba.identify.evidence.modes.small_effects import mode_of
from kemba.identify.problem.problem import Array, Labels, Problem, Theta


def with_learnt_colour(
    problem: Problem, theta: Theta, blocks: Labels | None = None, careful: bool = False
) -> Problem:
    """The problem under the noise colour of a flexible model's residual about `theta`.

    A residual of the model under test would not do: a missing effect would pass for coloured
    noise. `careful`: the model at theta is good; see `Problem.recolour`.
    """
    if not problem.learns_colour:
        return problem
    return learnt_colour(problem, theta, blocks, careful)[0]


def learnt_colour(
    problem: Problem, theta: Theta, blocks: Labels | None, careful: bool
) -> tuple[Problem, Array]:
    """The same, and the Jacobian (n, k) at theta of the problem without colour."""
    plain = problem.recolour(None)
    blocks = time_blocks(plain) if blocks is None else blocks
    linear, jacobian, _ = linearise(plain, theta, blocks)
    on = tuple(n for n, c in plain.candidates.items() if is_on(theta, c.key, c.lead))
    mode = mode_of(plain, on, [theta], linear, jacobian, blocks)
    left = mode.residual + jacobian @ (best_fit(mode.linear) - mode.linear.at)
    return plain.recolour(left, careful=careful), jacobian


def best_fit(linear: Linear) -> Array:
    """z (k,) of the best fit, every parameter free within its prior."""
    gram, slope, _ = linear.total
    precision = 1.0 / linear.width**2
    shift = linear.mean - linear.at
    h = (gram + np.diag(precision)) * np.outer(linear.width, linear.width)
    eta = linear.width * (precision * shift - slope)
    return linear.at + linear.width * np.linalg.solve(h, eta)
