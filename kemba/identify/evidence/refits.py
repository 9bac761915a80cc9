"""The hypotheses of a search that were refitted, each judged at its mode."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field

import numpy as np

from kemba.identify.evidence.linear import estimate, names_of
from kemba.identify.evidence.null_model import Baseline
from kemba.identify.evidence.point import LinearisationPoint
from kemba.identify.evidence.refit import Fit, refit
from kemba.identify.evidence.search_settings import SearchSettings
from kemba.identify.evidence.spike_slab import NULL, Hypothesis, log_prior, probabilities
from kemba.identify.problem.problem import Problem, Theta
from kemba.stopwatch import Stage


@dataclass
class Refits:
    """The null model, and every hypothesis that was refitted beside it.

    `problem`: the problem as it is now; it is replaced when its noise colour is learnt or its
    motion found again. `deadline`: when to stop searching, `due`: when the answer is due, by
    `time.monotonic` [s]. `say`: told of progress. `points`: every hypothesis that was refitted.
    `begin`: figures of the model as it is, where a fit found them already. `base`: the null model.
    `in_pieces`: the error that is told is of quarters of runs left out, and not of whole runs.
    `own`: the problem and theta of the model as it is, along the motion that it makes of the data
    itself, where late sensors have led to a motion along which it cannot be judged.
    """

    problem: Problem
    deadline: float = np.inf
    say: Callable[[str], None] = lambda text: None
    points: dict[Hypothesis, LinearisationPoint] = field(default_factory=dict)
    begin: Mapping[str, float] = field(default_factory=dict)
    due: float = np.inf
    in_pieces: bool = False
    own: tuple[Problem, Theta] | None = None
    base: Baseline = field(init=False)
    _thetas: dict[Hypothesis, dict[str, float]] = field(default_factory=dict)
    _stale: bool = False

    @property
    def ended(self) -> bool:
        """Whether the time is over. A first effect is refitted all the same."""
        return time.monotonic() > self.deadline

    @property
    def late(self) -> bool:
        """Whether the answer is due: nothing more is refitted to doubt it."""
        return time.monotonic() > self.due

    def visit(self, hypothesis: Hypothesis, number: int = 1, of: int = 1) -> LinearisationPoint:
        """Refit a hypothesis, once, and score it there; `number` `of` so many, for who waits."""
        if hypothesis not in self.points:
            name = f"refitting {' + '.join(hypothesis)}"
            self.say(Stage(name, number, of) if of > 1 else name)
            fit = refit(self.problem, hypothesis, self._guess(hypothesis), self.base.frozen)
            self._learn_secant(hypothesis, fit)
            self.points[hypothesis] = self._point(hypothesis, fit)
            self._thetas[hypothesis] = fit.theta
        return self.points[hypothesis]

    def _learn_secant(self, hypothesis: Hypothesis, fit: Fit) -> None:
        """From here on a refitted effect counts by its secant, no longer by its slope at nothing.

        Under every hypothesis each absent effect may be there with a small share of its size. Far
        from nothing its slope may promise more than the effect can do. A wrong hypothesis would
        then look good because of an effect that it does not name.
        """
        problem, (effect, *others) = self.problem, hypothesis
        candidate = problem.candidates[effect]
        if others or not problem.moves or problem.is_straight(candidate.key):
            return
        size = fit.theta[candidate.key] - candidate.lead.off
        if abs(size) > SearchSettings.least * candidate.lead.size:
            own = set(candidate.keys())
            absent = {k: v for k, v in fit.theta.items() if k not in own}
            change = problem.residual(fit.theta) - problem.residual(absent)
            self.base.jacobian[:, self.base.point.linear.index(candidate.key)] = change / size
            self._stale = True

    def refresh(self) -> None:
        """Score everything again with the secants learnt."""
        if self._stale:
            self.base.rescore()
            self._judge_again()
            self._stale = False

    def _judge_again(self) -> None:
        """Score every refitted hypothesis beside the null as it is now."""
        others = {h: self._point(h, p.fit) for h, p in self.points.items() if h}
        self.points = {**others, NULL: self.base.point}

    def _point(self, hypothesis: Hypothesis, fit: Fit) -> LinearisationPoint:
        """The problem about a refitted point: slopes of its own parameters are those of the fit,
        all others are the null's."""
        names, base = names_of(self.problem, fit.theta), self.base
        known = {n: i for i, n in enumerate(base.point.linear.names)}
        own = {i: fit.columns[n] for i, n in enumerate(names) if n in fit.columns}
        at = [0 if i in own else known[n] for i, n in enumerate(names)]
        slopes = np.take(base.jacobian, at, axis=1)
        for i, column in own.items():
            slopes[:, i] = column
        return base.judged(hypothesis, fit, names, slopes)

    def _guess(self, hypothesis: Hypothesis) -> dict[str, float]:
        """Where a refit starts: at its last result, or at the linear estimate from the largest part
        of the hypothesis that was refitted."""
        if hypothesis in self._thetas:
            return self._thetas[hypothesis]
        parts = [h for h in self.points if set(h) < set(hypothesis)]
        part = max(parts, key=lambda h: (len(h), self.points[h].log_evidence))
        point = self.points[part]
        linear = point.mode.linear
        z = self.base.ranker(linear).score(hypothesis).z
        guess = estimate(self.problem, linear, z)
        return {**guess, **{k: v for k, v in point.fit.theta.items() if k not in guess}}

    def best(self) -> Hypothesis:
        """The likeliest of all refitted hypotheses."""
        self.refresh()
        count = len(self.problem.candidates)
        return max(self.points, key=lambda h: self.points[h].log_evidence + log_prior(h, count))

    def singles(self) -> dict[Hypothesis, float]:
        """Linear evidence of every single effect."""
        return {h: e for h, e in self.base.table.items() if len(h) == 1}

    def probabilities(self, dismissed: Collection[Hypothesis] = ()) -> dict[Hypothesis, float]:
        """Of all refitted hypotheses, and of the other single effects by their linear evidence;
        without the hypotheses `dismissed` as too small or as refuted by left-out data."""
        evidence = self.singles()
        evidence |= {h: p.log_evidence for h, p in self.points.items()}
        evidence = {h: e for h, e in evidence.items() if h not in dismissed}
        return probabilities(evidence, len(self.problem.candidates))
