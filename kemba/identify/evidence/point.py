"""One hypothesis refitted, and the problem linearised there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from kemba.identify.evidence.linear import Linear, LinearSettings, condense, priors, time_blocks
from kemba.identify.evidence.refit import Fit
from kemba.identify.evidence.small_effects import Mode
from kemba.identify.evidence.spike_slab import Hypothesis, Score
from kemba.identify.evidence.windows import Windows, windows_of
from kemba.identify.problem.problem import Array, Labels, Problem


def excess(error: float) -> float:
    """The part of an error, in units of the noise, that noise does not make."""
    return float(np.sqrt(max(error**2 - 1.0, 0.0)))


@dataclass(frozen=True)
class LinearisationPoint:
    """A hypothesis refitted, with the problem linearised there.

    `linear`: by rows; `windowed`: by sums over aggregation windows; in both of them effects that it
    does not name are absent. `mode`: its best fit, where they may be there a little.
    `score`: evidence of the hypothesis. `left_out`: errors that are computed already.
    """

    hypothesis: Hypothesis
    fit: Fit
    linear: Linear
    windowed: Linear
    mode: Mode
    score: Score
    left_out: dict[bool, Array] = field(default_factory=dict, compare=False)

    @property
    def log_evidence(self) -> float:
        """Log evidence [nats] of the hypothesis."""
        return self.score.log_evidence

    @property
    def fitted_error(self) -> float:
        """Error in units of the noise on the fitted logs: RMS over aggregation windows."""
        return float(np.sqrt(self.windowed.power.sum() / self.windowed.count.sum()))


class Division:
    """The rows of a problem divided into time blocks (n,), quarters of runs, and into aggregation
    windows; `parts` (b,): which blocks are left out together, as a rule all those of a run."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.windows: Windows = windows_of(problem)
        usual = time_blocks(problem)
        fine = time_blocks(problem, LinearSettings.pieces * len(problem.runs))
        windows = np.unique(fine[self.windows.first])
        short = len(windows) <= fine.max()  # a piece in which no window begins
        self.blocks: Labels = usual if short else fine
        self.parts: Labels = usual[np.unique(self.blocks, return_index=True)[1]]

    def linear(
        self, theta: Mapping[str, float], names: tuple[str, ...], jacobian: Array, r: Array
    ) -> tuple[Linear, Linear]:
        """The problem about theta with these slopes (n, k), row by row and by windows."""
        at = priors(self.problem, theta, names)
        fine = condense(names, *at, jacobian, r, self.blocks)
        if len(self.windows.first) == len(r):
            return fine, fine
        sums = self.windows.sums(jacobian), self.windows.sums(r)
        windowed = condense(names, *at, *sums, self.blocks[self.windows.first])
        return fine, windowed
