"""The search: null fit, ranking, refits of the leaders, growth, and what each step believed."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol, runtime_checkable

import numpy as np

from kemba.identify.fit import Fit, Frozen, refit
from kemba.identify.linear import (
    Linear,
    condense,
    estimate,
    linearise,
    moved,
    names_of,
    priors,
    time_blocks,
    within,
)
from kemba.identify.problem import Array, Labels, Problem
from kemba.identify.rank import FLOOR, NULL, Hypothesis, Ranker, Score, log_prior, probabilities

LEADERS = 6
SURE = 3  # so many leaders are refitted however far behind they are,
FAR, FAR_SHARE = 40.0, 0.7  # others when no more nats, or share of the gain, behind
GLANCES = 1  # evaluations of each single effect before the leaders are refitted
ABSURD = 1e5  # noise units
FOLLOWED = 2  # times that the motion is found again with the best guess
LARGEST = 3  # effects in one answer; more need another experiment
GAIN = 3.0  # nats beyond prior odds that a further effect must bring


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


@runtime_checkable
class Colourable(Protocol):
    """A problem whose noise colour can be learnt from the residuals of a flexible model."""

    def recolour(self, residual: Array | None, careful: bool = False) -> None:
        """Learn from residuals (n,) that were not whitened; None: forget. `careful`: the model
        behind them is good, so that spikes are no physics and may be silenced."""

    def whiten(self, columns: Array) -> Array:
        """Columns (n, k) computed before any colour as they are under the present one."""


@runtime_checkable
class Movable(Protocol):
    """A problem that is linearised along a motion, which depends on the model."""

    def relinearise(self, base: Mapping[str, float]) -> None:
        """Find the motion again with the model at `base`; rows may be others than before."""

    def is_straight(self, name: str) -> bool:
        """Whether residuals are linear in this parameter, so that slopes tell all."""


@dataclass
class Search:
    """State of one search on one problem; `run` fills it."""

    problem: Problem
    deadline: float = np.inf
    say: Callable[[str], None] = lambda text: None
    heat: float = 1.0
    blocks: Labels = field(init=False)
    points: dict[Hypothesis, Point] = field(default_factory=dict)
    null_table: dict[Hypothesis, float] = field(default_factory=dict)
    null_jacobian: Array = field(init=False)
    null_residual: Array = field(init=False)
    among: frozenset[Hypothesis] | None = None  # singles that deserve more than a linear look
    _thetas: dict[Hypothesis, dict[str, float]] = field(default_factory=dict)
    _settled: bool = False  # whether the noise is seen from a point that fits

    def __post_init__(self) -> None:
        self.blocks = time_blocks(self.problem)

    # -- steps ------------------------------------------------------------------------------

    def run(self) -> Hypothesis:
        """The hypothesis the evidence favours; everything seen stays in `points`."""
        self.say("fitting the model as it is")
        self.start()
        best = self._round(NULL, LEADERS)
        self.say(f"first guess: {' + '.join(best) or 'nothing'}")
        if isinstance(self.problem, Movable):
            return self._follow(self.problem, best)
        if best != NULL:
            promising = self._promising()
            self._recolour(best)
            for hypothesis in promising:
                self.visit(hypothesis)
            best = self._round(NULL, LEADERS)
            best = self._grow(best)
        return best

    def _follow(self, problem: Movable, best: Hypothesis) -> Hypothesis:
        """Look again along the motion that the best guess makes of the data, until it stays.

        A guess far from the first motion looks bad only for being far: what the slopes promise
        counts as well as what the refit found.
        """
        for _ in range(FOLLOWED):
            guess = best or self._promised()
            if guess == NULL or time.monotonic() > self.deadline:
                return best
            point = self.points[guess]
            self.say(f"looking again as if {' + '.join(guess)} were there")
            self.among = self._contenders()
            problem.relinearise(point.fit.theta)
            self.blocks = time_blocks(self.problem)
            self.start()
            self.visit(guess)
            best = self._round(NULL, LEADERS)
            if best in (guess, NULL):
                break
        return self._grow(best) if best else best

    def _contenders(self) -> frozenset[Hypothesis]:
        """Single effects that were refitted, or promise half of what the best one does."""
        null = self.points[NULL].log_evidence
        gains = {h: e - null for h, e in self.null_table.items() if len(h) == 1}
        least = 0.5 * max(gains.values())
        return frozenset(h for h, gain in gains.items() if gain > least or h in self.points)

    def _promised(self) -> Hypothesis:
        """The refitted single effect that the table puts first, if it pays there."""
        count = len(self.problem.candidates)
        null = self.points[NULL].log_evidence + log_prior(NULL, count)
        tables: dict[Hypothesis, float] = {
            h: e for h, e in self.null_table.items() if h in self.points and len(h) == 1
        }
        first = max(tables, key=tables.__getitem__, default=NULL)
        pays = first and tables[first] + log_prior(first, count) > null
        return first if pays else NULL

    def start(self) -> None:
        """Null fit, noise colour, and the linear table at the null."""
        free = tuple(self.problem.nuisance)
        moving = isinstance(self.problem, Movable)  # its slopes hold as far as tolerances reach
        names = names_of(self.problem, {}) if moving else free
        known = self.problem.jacobian({}, names)
        jacobian = known[:, [names.index(n) for n in free]]
        theta: dict[str, float] = {}
        for _ in range(2):
            r = self.problem.residual(theta)
            at, mean, width = priors(self.problem, theta, free)
            linear = condense(free, at, mean, width, jacobian, r, self.blocks)
            theta = estimate(self.problem, linear, best_fit(linear))
        self._null(theta, theta, known if moving else None)

    def _null(
        self,
        theta: Mapping[str, float],
        seen_from: Mapping[str, float],
        jacobian: Array | None = None,
    ) -> None:
        """Linear at the null, whitened by what is left over as seen from another point."""
        if jacobian is None:
            jacobian = self._learn_noise(seen_from, keep=theta is seen_from)
        if jacobian is None:
            names = names_of(self.problem, theta)
            jacobian = self.problem.jacobian(theta, names)
        names = names_of(self.problem, theta)
        r = self.problem.residual(theta)
        at, mean, width = priors(self.problem, theta, names)
        linear = condense(names, at, mean, width, jacobian, r, self.blocks)
        self.null_jacobian, self.null_residual = jacobian, r
        ranker = self.ranker(linear)
        fit = Fit(dict(theta), 0.5 * float(r @ r))
        self.points = {NULL: Point(NULL, fit, linear, ranker.score(NULL))}
        self.null_table = ranker.table((0, 1, 2) if self.among is None else (0, 1))
        for hypothesis in [h for h in self.null_table if len(h) == 1]:
            if self.among is None or hypothesis in self.among:
                self.null_table[hypothesis] = self._glance(hypothesis)

    def _glance(self, hypothesis: Hypothesis) -> float:
        """Log evidence where the linear estimate points to, with the true residual there.

        Times are far from linear, so they are looked at from both sides of their size as well.
        """
        (effect,) = hypothesis
        candidate, theta = self.problem.candidates[effect], self.points[NULL].fit.theta
        if isinstance(self.problem, Movable) and self.problem.is_straight(candidate.key):
            return self.null_table[hypothesis]
        starts: list[dict[str, float]] = [dict(theta)]
        if candidate.lead.unit == "s":
            signs = (1.0, -1.0) if candidate.lead.signed else (1.0,)
            starts += [{**theta, **within(self.problem, candidate.typical(s))} for s in signs]
        return max(self._descend(hypothesis, start) for start in starts)

    def _descend(self, hypothesis: Hypothesis, theta: dict[str, float]) -> float:
        """The best log evidence on a few Newton steps from theta with the slopes of the null."""
        free = {*self.problem.nuisance, *(self.problem.candidates[e].key for e in hypothesis)}
        linear, best = self.points[NULL].linear, -np.inf
        own = np.array([name in free for name in linear.names])
        for step in range(GLANCES + 1):
            if step or theta != self.points[NULL].fit.theta:
                r = self.problem.residual(theta)
                if not np.all(np.abs(r) < ABSURD):
                    break  # a linear estimate may point to where nothing can be predicted
                at, _, _ = priors(self.problem, theta, linear.names)
                linear = moved(linear, at, self.null_jacobian, r, self.blocks)
            score = self.ranker(linear).score(hypothesis)
            best = max(best, score.log_evidence)
            at = np.where(own, score.z, linear.at)
            theta = within(self.problem, estimate(self.problem, linear, at))
        return best

    def flexible_fit(self) -> Array:
        """z (k,) at the null with every effect free at its full size."""
        return best_fit(self.points[NULL].linear)

    def ranker(self, linear: Linear, floor: float = FLOOR) -> Ranker:
        return Ranker(linear, self.problem.candidates, self.problem.nuisance, self.heat, floor)

    @property
    def frozen(self) -> Frozen:
        names = tuple(self.problem.nuisance)
        at = [self.points[NULL].linear.index(n) for n in names]
        return Frozen(names, self.null_jacobian[:, at])

    def _round(self, given: Hypothesis, leaders: int) -> Hypothesis:
        """Refit the most promising extensions of `given` by one; the best of all points so far."""
        table = self._extensions(given)
        order = sorted(table, key=lambda h: -table[h])[:leaders]
        promise = table[order[0]] - self.points[given].log_evidence
        reach = max(FAR, FAR_SHARE * promise)
        for hypothesis in order:
            if given and table[hypothesis] < self.points[given].log_evidence:
                break  # not even the slopes promise anything
            if table[hypothesis] < table[order[0]] - reach and hypothesis not in order[:SURE]:
                break
            if time.monotonic() > self.deadline:
                break
            self.visit(hypothesis)
        return self.best()

    def _extensions(self, given: Hypothesis) -> dict[Hypothesis, float]:
        """Linear evidence of `given` plus one effect, pairs lending theirs to their members."""
        if given != NULL:
            ranker = self.ranker(self.points[given].linear)
            return ranker.table((len(given) + 1,), given=given)
        single: dict[Hypothesis, float] = {h: e for h, e in self.null_table.items() if len(h) == 1}
        base = max(single.values())
        pairs = [h for h in self.null_table if len(h) == 2]
        best_pair = max(pairs, key=self.null_table.__getitem__, default=NULL)
        if best_pair and self.null_table[best_pair] > base + GAIN:
            for name in best_pair:
                single[(name,)] = max(single[(name,)], base)
        return single

    def visit(self, hypothesis: Hypothesis) -> Point:
        """Refit a hypothesis (once) and score it there."""
        if hypothesis not in self.points:
            self.say(f"refitting {' + '.join(hypothesis)}")
            fit = refit(self.problem, hypothesis, self._guess(hypothesis), self.frozen, self.heat)
            linear = self._near(fit)
            score = self._compared(linear, hypothesis)
            self.points[hypothesis] = Point(hypothesis, fit, linear, score)
            self._thetas[hypothesis] = fit.theta
        return self.points[hypothesis]

    def _compared(self, linear: Linear, hypothesis: Hypothesis) -> Score:
        """Score on `linear`, measured against nothing on the same slopes.

        The floor lets every effect help "nothing" as well, by slopes that promise too much far
        from where they hold: only promises of the same slopes may be compared.
        """
        ranker = self.ranker(linear)
        score = ranker.score(hypothesis)
        if not isinstance(self.problem, Movable):
            return score
        gain = score.log_evidence - ranker.score(NULL).log_evidence
        return replace(score, log_evidence=self.points[NULL].log_evidence + gain)

    def _near(self, fit: Fit) -> Linear:
        """Linear at a refitted point: its own slopes are fresh, the others are the null's."""
        names = names_of(self.problem, fit.theta)
        known = self.points[NULL].linear
        columns = [
            fit.columns[n] if n in fit.columns else self.null_jacobian[:, known.index(n)]
            for n in names
        ]
        r = self.problem.residual(fit.theta)
        at, mean, width = priors(self.problem, fit.theta, names)
        return condense(names, at, mean, width, np.stack(columns, axis=1), r, self.blocks)

    def _guess(self, hypothesis: Hypothesis) -> dict[str, float]:
        """Where it was before, or the largest part that was refitted, moved by the linear
        estimate there."""
        if hypothesis in self._thetas:
            return self._thetas[hypothesis]
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

    def _learn_noise(self, theta: Mapping[str, float], keep: bool) -> Array | None:
        """Colour of what remains when every effect of the catalogue may help to explain.

        Returns the Jacobian at theta under the new colour when it is wanted (`keep`).
        """
        problem = self.problem
        if not isinstance(problem, Colourable):
            return None
        problem.recolour(None)
        linear, jacobian, r = linearise(problem, theta, self.blocks)
        left = r + jacobian @ (best_fit(linear) - linear.at)
        problem.recolour(left, careful=not keep or self._settled)
        return problem.whiten(jacobian) if keep else None

    def _promising(self) -> list[Hypothesis]:
        """What was refitted and gained at least half of what the best gained."""
        null = self.points[NULL].log_evidence
        gains = {h: p.log_evidence - null for h, p in self.points.items() if h}
        return [h for h, gain in gains.items() if gain > 0.5 * max(gains.values())]

    def _recolour(self, best: Hypothesis) -> None:
        """The same, seen from the best point so far; all points are then refitted."""
        theta, null = self.points[best].fit.theta, self.points[NULL].fit.theta
        self._null(null, theta)

    def probabilities(self) -> dict[Hypothesis, float]:
        """Over everything refitted, and the rest of the singles by their linear evidence."""
        evidence = {h: p.log_evidence for h, p in self.points.items()}
        for h, e in self.null_table.items():
            if len(h) == 1:
                evidence.setdefault(h, e)
        return probabilities(evidence, len(self.problem.candidates))


def best_fit(linear: Linear) -> Array:
    """z (k,) with every name free within its prior."""
    gram, slope, _ = linear.total
    precision = 1.0 / linear.width**2
    shift = linear.mean - linear.at
    h = (gram + np.diag(precision)) * np.outer(linear.width, linear.width)
    eta = linear.width * (precision * shift - slope)
    return linear.at + linear.width * np.linalg.solve(h, eta)


def share_of(probability: Mapping[Hypothesis, float], effects: Iterable[str]) -> dict[str, float]:
    """Probability that each effect is among the missing ones."""
    return {e: sum(p for h, p in probability.items() if e in h) for e in effects}
