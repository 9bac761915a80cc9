"""The search: null fit, ranking, refits of the leaders, growth, and what each step believed."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from kemba.identify.fit import Fit, Frozen, refit
from kemba.identify.linear import Linear, estimate, linearise, time_blocks
from kemba.identify.problem import Array, Problem
from kemba.identify.rank import Hypothesis, Ranker, Score, log_prior, probabilities

LEADERS = 6
LARGEST = 3  # effects in one answer; more need another experiment
GAIN = 3.0  # nats beyond prior odds that a further effect must bring
NULL: Hypothesis = ()


@dataclass(frozen=True)
class Point:
    """One hypothesis refitted, and the problem linearised there."""

    hypothesis: Hypothesis
    fit: Fit
    linear: Linear
    score: Score

    @property
    def log_evidence(self) -> float:
        return self.score.log_evidence


@dataclass
class Search:
    """State of one search on one problem; `run` fills it."""

    problem: Problem
    deadline: float = np.inf
    say: Callable[[str], None] = lambda text: None
    heat: float = 1.0
    blocks: Array = field(init=False)
    points: dict[Hypothesis, Point] = field(default_factory=dict)
    null_table: dict[Hypothesis, float] = field(default_factory=dict)
    null_jacobian: Array = field(init=False)
    null_residual: Array = field(init=False)

    def __post_init__(self) -> None:
        self.blocks = time_blocks(self.problem)

    # -- steps ------------------------------------------------------------------------------

    def run(self) -> Hypothesis:
        """The hypothesis the evidence favours; everything seen stays in `points`."""
        self.say("fitting the model as it is")
        self.start()
        best = self._round(NULL, LEADERS)
        self.say(f"first guess: {' + '.join(best) or 'nothing'}")
        if best != NULL:
            self._recolour(best)
            best = self._round(NULL, LEADERS)
            best = self._grow(best)
        return best

    def start(self) -> None:
        """Null fit, noise colour, and the linear table at the null."""
        theta: dict[str, float] = {}
        for _ in range(2):
            theta = self._null_step(theta)
        self._learn_noise(theta)
        self._null(theta)

    def _null_step(self, theta: Mapping[str, float]) -> dict[str, float]:
        linear, _, _ = linearise(self.problem, theta, self.blocks, tuple(self.problem.nuisance))
        score = _nuisance_fit(linear)
        return estimate(self.problem, linear, score)

    def _null(self, theta: Mapping[str, float]) -> None:
        linear, jacobian, r = linearise(self.problem, theta, self.blocks)
        self.null_jacobian, self.null_residual = jacobian, r
        ranker = self.ranker(linear)
        fit = Fit(dict(theta), 0.5 * float(r @ r))
        self.points = {NULL: Point(NULL, fit, linear, ranker.score(NULL))}
        self.null_table = ranker.table((0, 1, 2))

    def ranker(self, linear: Linear) -> Ranker:
        return Ranker(linear, self.problem.candidates, self.problem.nuisance, self.heat)

    @property
    def frozen(self) -> Frozen:
        names = tuple(self.problem.nuisance)
        at = [self.points[NULL].linear.index(n) for n in names]
        return Frozen(names, self.null_jacobian[:, at])

    def _round(self, given: Hypothesis, leaders: int) -> Hypothesis:
        """Refit the most promising extensions of `given` by one; the best of all points so far."""
        table = self._extensions(given)
        order = sorted(table, key=lambda h: -table[h])
        for hypothesis in order[:leaders]:
            if time.monotonic() > self.deadline:
                break
            self.visit(hypothesis)
        return self.best()

    def _extensions(self, given: Hypothesis) -> dict[Hypothesis, float]:
        """Linear evidence of `given` plus one effect, pairs lending theirs to their members."""
        if given != NULL:
            ranker = self.ranker(self.points[given].linear)
            return ranker.table((len(given) + 1,), given=given)
        single = {h: e for h, e in self.null_table.items() if len(h) == 1}
        base = max(single.values())
        best_pair = max((h for h in self.null_table if len(h) == 2), key=self.null_table.__getitem__)
        if self.null_table[best_pair] > base + GAIN:
            for name in best_pair:
                single[(name,)] = max(single[(name,)], base)
        return single

    def visit(self, hypothesis: Hypothesis) -> Point:
        """Refit a hypothesis and linearise there (once)."""
        if hypothesis not in self.points:
            self.say(f"refitting {' + '.join(hypothesis)}")
            fit = refit(self.problem, hypothesis, self._guess(hypothesis), self.frozen, self.heat)
            linear, _, _ = linearise(self.problem, fit.theta, self.blocks)
            self.points[hypothesis] = Point(
                hypothesis, fit, linear, self.ranker(linear).score(hypothesis)
            )
        return self.points[hypothesis]

    def _guess(self, hypothesis: Hypothesis) -> dict[str, float]:
        """Start from the largest part that was refitted, moved by the linear estimate there."""
        parts = [h for h in self.points if set(h) < set(hypothesis)]
        part = max(parts, key=lambda h: (len(h), self.points[h].log_evidence))
        point = self.points[part]
        z = self.ranker(point.linear).score(hypothesis).z
        guess = estimate(self.problem, point.linear, z)
        return {**guess, **{k: v for k, v in point.fit.theta.items() if k not in guess}}

    def best(self) -> Hypothesis:
        count = len(self.problem.candidates)
        return max(self.points, key=lambda h: self.points[h].log_evidence + log_prior(h, count))

    def _grow(self, best: Hypothesis) -> Hypothesis:
        """Add while it pays; then try to swap each member for another."""
        while len(best) < LARGEST and time.monotonic() < self.deadline:
            grown = self._round(best, 3)
            if grown == best or len(grown) <= len(best):
                break
            best = grown
        for member in best if len(best) > 1 else ():
            rest = tuple(h for h in best if h != member)
            self.visit(rest)
            self._round(rest, 2)
        return self.best()

    # -- noise ------------------------------------------------------------------------------

    def _learn_noise(self, theta: Mapping[str, float]) -> None:
        """Colour of what remains when every effect of the catalogue may help to explain."""
        if not hasattr(self.problem, "recolour"):
            return
        self.problem.recolour(None)
        linear, jacobian, r = linearise(self.problem, theta, self.blocks)
        self.problem.recolour(r + jacobian @ (_flexible(linear) - linear.at))

    def _recolour(self, best: Hypothesis) -> None:
        """The same, seen from the best point so far; all points are then refitted."""
        theta, null = self.points[best].fit.theta, self.points[NULL].fit.theta
        self._learn_noise(theta)
        self._null(null)

    def probabilities(self) -> dict[Hypothesis, float]:
        """Over everything refitted, and the rest of the singles by their linear evidence."""
        evidence = {h: p.log_evidence for h, p in self.points.items()}
        for h, e in self.null_table.items():
            if len(h) == 1:
                evidence.setdefault(h, e)
        return probabilities(evidence, len(self.problem.candidates))


def _nuisance_fit(linear: Linear) -> Array:
    gram, slope, _ = linear.total
    precision = 1.0 / linear.width**2
    shift = linear.mean - linear.at
    h = (gram + np.diag(precision)) * np.outer(linear.width, linear.width)
    eta = linear.width * (precision * shift - slope)
    return linear.at + linear.width * np.linalg.solve(h, eta)


_flexible = _nuisance_fit  # with every switch among the names: all effects at their full size


def share_of(probability: Mapping[Hypothesis, float], effects: Iterable[str]) -> dict[str, float]:
    """Probability that each effect is among the missing ones."""
    return {e: sum(p for h, p in probability.items() if e in h) for e in effects}
