"""The colour of the noise, learnt from what is left when every effect may help to explain."""

import numpy as np

from kemba.identify.infer.linear import is_on, linearise, time_blocks
from kemba.identify.infer.mode import mode_of
from kemba.identify.problem.problem import Problem
from kemba.identify.problem.sensor_faults import moves_readings
from kemba.identify.problem.types import Array, Labels, Theta


class DriftSettings:
    """When the sensors are taken to drift."""

    strong = 3.0  # evidence from which sensors drift [nats]: Kass and Raftery 1995, twenty to one


def with_learnt_colour(
    problem: Problem, theta: Theta, blocks: Labels | None = None, careful: bool = False
) -> Problem:
    """The problem under the noise colour of a flexible model's residual (n,) about `theta`.

    A residual of the model under test would not do: a missing effect would pass for coloured
    noise. `careful`: the model at theta is good; see `Problem.recolour`.
    """
    if not problem.learns_colour:
        return problem
    found = learnt_colour(problem, theta, blocks, careful)[0]
    blamed = any(moves_readings(n) for n in theta if n not in problem.nuisance)
    return _with_drift(found, theta) if careful and (blamed or not problem.moves) else found


def _with_drift(problem: Problem, theta: Theta) -> Problem:
    """The problem with drifting sensors, where the logs are clearly likelier so."""
    drifting = problem.drifting()
    if drifting is None:
        return problem
    gain = log_likelihood(drifting, theta) - log_likelihood(problem, theta)
    return drifting if gain > DriftSettings.strong else problem


def log_likelihood(problem: Problem, theta: Theta) -> float:
    """Log likelihood [nats] of the logs, up to a constant, all effects free within their priors."""
    linear, _, _ = linearise(problem, theta, time_blocks(problem))
    h = linear.total[0] * np.outer(linear.width, linear.width) + np.eye(len(linear.width))
    spread = 0.5 * float(np.linalg.slogdet(h)[1])
    return problem.log_density() - linear.cost(linear.best()) - spread


def learnt_colour(
    problem: Problem, theta: Theta, blocks: Labels | None, careful: bool
) -> tuple[Problem, Array]:
    """The same, and the Jacobian (n, k) at theta of the problem without colour."""
    plain = problem.recolour(None)
    blocks = time_blocks(plain) if blocks is None else blocks
    linear, jacobian, _ = linearise(plain, theta, blocks)
    on = tuple(n for n, c in plain.candidates.items() if is_on(theta, c.key, c.lead))
    mode = mode_of(plain, on, [theta], linear, jacobian, blocks)
    left = mode.residual + jacobian @ (mode.linear.best() - mode.linear.at)
    return plain.recolour(left, careful=careful), jacobian
