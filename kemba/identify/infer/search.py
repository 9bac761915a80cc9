"""The search: fit of the null, ranking, refits of the leaders, further effects one by one."""

import time
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import numpy as np

from kemba.identify.infer.linear import (
    NULL,
    Hypothesis,
    SpikeSlabSettings,
    estimate,
    log_prior,
    names_of,
    probabilities,
)
from kemba.identify.infer.null_model import Baseline, LinearisationPoint, with_learnt_colour
from kemba.identify.infer.refit import Fit, Frozen, RefitSettings, refit
from kemba.identify.infer.windows import START
from kemba.identify.problem.problem import Problem, Theta
from kemba.identify.problem.sensor_faults import is_fault
from kemba.stopwatch import Stage, Tell, silent

# Which hypotheses are refitted.
LEADERS = 6  # effects that are refitted in a round
SURE = 3  # leaders that are refitted however far behind they are
SURE_GROWN = 2  # the same beside effects that are found already
FAR = 40.0  # other leaders are refitted when not farther behind [nats]
# error of the model as it is, in noise units, from which another structure is refitted whatever
# its linear evidence is
STRUCTURAL = 1.3
FAR_SHARE = 0.7  # or no farther behind than this share of the gain
FOLLOWED = 5  # times that the motion is found again with the best answer, at most
# times that the motion is found before a search along it, until late sensors stay as late: a
# piston 5.2 ms late is found 3.2 ms late along the motion as it is read, 5.2 ms along the
# second one after it
SETTLED = 4
STILL = 0.1  # change of such a delay, in rows, at which it stays: below its 1 sigma
LARGEST = 10  # effects in one answer: more than any machine is expected to lack
SWAPPED = 2  # rounds in which effects of an answer are taken away or swapped
LEADERS_GROWN = 3  # effects that are refitted beside the best answer
LEADERS_SWAPPED = 2  # effects that are refitted in place of one of the answer
ALONE = 3  # effects that are refitted because they gain most where no other is there at all
AT_BOUND = 0.01  # tolerances from its bound within which a figure is at it: rounding of a fit
FAR_OFF = 0.1  # size of an effect from which its secant replaces its slope


@dataclass
class Search:
    """The null model, and every hypothesis that was refitted beside it; `run` fills it.

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
    say: Tell = silent
    points: dict[Hypothesis, LinearisationPoint] = field(default_factory=dict)
    begin: Mapping[str, float] = field(default_factory=dict)
    due: float = np.inf
    in_pieces: bool = False
    own: tuple[Problem, Theta] | None = None
    base: Baseline = field(init=False)
    _thetas: dict[Hypothesis, dict[str, float]] = field(default_factory=dict)
    _secants: bool = False  # taken since everything was scored

    @property
    def ended(self) -> bool:
        """Whether the time is over. A first effect is refitted all the same."""
        return time.monotonic() > self.deadline

    @property
    def late(self) -> bool:
        """Whether the answer is due: nothing more is refitted to doubt it."""
        return time.monotonic() > self.due

    def run(self) -> Hypothesis:
        """The likeliest hypothesis; everything that was refitted stays in `points`."""
        self.start()
        return self.further(self.first())

    def first(self) -> Hypothesis:
        """The first guess: the best of the single effects that look best."""
        best = self._round(NULL, LEADERS)
        self.say(f"first guess: {' + '.join(best) or 'nothing'}")
        return best

    def further(self, best: Hypothesis) -> Hypothesis:
        """The likeliest hypothesis, searched for from the first guess: again with what it tells of
        the noise, or where the motion depends on the model of the motion, until it stays."""
        for _ in range(FOLLOWED if self.problem.moves else 1):
            if best == NULL or self.ended:
                return best
            before = best
            self._again(best)
            best = self._grow(self._round(NULL, LEADERS))
            if best == before:
                break
        return self._swap(best) if best else best

    def _again(self, best: Hypothesis) -> None:
        """Begin again under the noise, or along the motion, that the best hypothesis makes."""
        self.say(f"searching again with {' + '.join(best)} in the model")
        if self.problem.moves:
            self.start(self._settle(best))
        else:
            self.base.seen_from(self.points[best].fit.theta)
            self.problem, self.points = self.base.problem, {NULL: self.base.point}
        self.visit(best)

    def _settle(self, hypothesis: Hypothesis) -> Mapping[str, float]:
        """Find the motion of a hypothesis until late sensors stay as late; the best theta."""
        theta = self.points[hypothesis].fit.theta
        asked = self.problem
        for _ in range(SETTLED):
            self.problem = self.problem.relinearise(theta)
            late = self.problem.held_back(theta)
            if not late or self.ended:
                break
            self.own = self.own or (asked, self.points[NULL].fit.theta)
            figures, before = tuple(self.problem.nuisance), theta
            slopes = Frozen(figures, self.problem.jacobian(theta, figures))
            theta = refit(self.problem, hypothesis, theta, slopes).theta
            self._thetas[hypothesis] = dict(theta)
            moved = max(abs(theta[name] - before[name]) for name in late)
            if moved < STILL * self.problem.interval:
                break
        return theta

    def start(self, theta: Mapping[str, float] | None = None) -> None:
        """Null fit, noise colour, and the linear table at the null; `theta`: the best guess."""
        if theta is None:
            self.say("fitting the model as it is, and a slope for every effect")
        if self.problem.moves:
            about = theta or self.begin
            self.problem = with_learnt_colour(self.problem, about, careful=bool(theta))
        self.base = Baseline(self.problem, theta or self.begin)
        self.problem = self.base.problem
        self.points = {NULL: self.base.point}

    def _round(self, given: Hypothesis, leaders: int, least: float = -np.inf) -> Hypothesis:
        """Refit `given` with one more effect, of the likeliest ones; the best of all points."""
        table = self.base.table
        if given:  # linear evidence of it and one more effect
            table = self.base.ranker(self.points[given].mode.linear).table(given)
        order = sorted(table, key=lambda h: -table[h])[:leaders]
        gain = table[order[0]] - self.points[given].log_evidence
        reach = max(FAR, FAR_SHARE * gain)
        sure = SURE_GROWN if given else SURE
        for number, hypothesis in enumerate(order, start=1):
            if table[hypothesis] < least:
                break
            if given and table[hypothesis] < self.points[given].log_evidence:
                break  # even the linear evidence gains nothing
            if table[hypothesis] < table[order[0]] - reach and hypothesis not in order[:sure]:
                break
            if self.ended and (given or number > 1):
                break
            self.visit(hypothesis, number, len(order))
        if given == NULL and self.is_strained and self._gain() < FAR:
            self._afresh()
        if given == NULL and self.best() != NULL:
            self._alone()
        if given == NULL and self.points[NULL].fitted_error > STRUCTURAL:
            for structure in sorted(self.problem.structures):
                self.visit((structure,))
        return self.best()

    def _alone(self) -> None:
        """Refit the effects that gain most where no other is there even a little: in logs that tell
        more than the prior, a little of several others explains what a late force sensor does, and
        the linear evidence gives nothing to that."""
        table = self.base.ranker(self.base.point.linear, spike=SpikeSlabSettings.silent).table()
        for hypothesis in sorted(table, key=lambda h: -table[h])[:ALONE]:
            if not self.ended:
                self.visit(hypothesis)

    @property
    def is_strained(self) -> bool:
        """Whether the fit of nothing ends at the bound of a figure, where nobody would believe it.
        Slopes there say little of what is missing."""
        if self.problem.moves:
            return False
        theta, far = self.points[NULL].fit.theta, RefitSettings.bound - AT_BOUND
        figures = (n for n in self.problem.nuisance if not (n.startswith(START) or is_fault(n)))
        priors = ((n, *self.problem.nuisance[n]) for n in figures if n in theta)
        return any(abs(theta[name] - mean) > far * width for name, mean, width in priors)

    def _gain(self) -> float:
        """Evidence [nats] of the best hypothesis over nothing."""
        return self.points[self.best()].log_evidence - self.points[NULL].log_evidence

    def _afresh(self) -> None:
        """Refit every single effect from its usual size, and the machine from what its file says:
        from little of the effect, figures stay where they are not believed."""
        points, singles = self.points, sorted(self.problem.candidates.items())
        for number, (effect, candidate) in enumerate(singles, start=1):
            if self.ended:
                break
            self.say(Stage(f"refitting {effect}", number, len(singles)))
            lead = candidate.lead
            for size in (lead.size, -lead.size) if lead.signed else (lead.size,):
                start = {candidate.key: lead.off + size}
                fit = refit(self.problem, (effect,), start, self.base.frozen)
                if (effect,) not in points or fit.cost < points[effect,].fit.cost:
                    points[effect,] = self._point((effect,), fit)
                    self._thetas[effect,] = fit.theta

    def _grow(self, best: Hypothesis) -> Hypothesis:
        """Add effects, one by one, while the evidence grows."""
        while len(best) < LARGEST and not self.ended:
            grown = self._round(best, LEADERS_GROWN)
            if grown == best or len(grown) <= len(best):
                break
            best = grown
        return best

    def _swap(self, best: Hypothesis) -> Hypothesis:
        """Take each effect away, or swap it for another; what was swapped may grow again."""
        for _ in range(SWAPPED):
            before = best
            for member in best if len(best) > 1 else ():
                if self.ended:
                    return self.best()
                rest = tuple(h for h in best if h != member)
                self.visit(rest)
                least = self.points[best].log_evidence - FAR
                self._round(rest, LEADERS_SWAPPED, least)
            best = self.best()
            if best == before or self.ended:
                break
            best = self._grow(best)
        return best

    def visit(self, hypothesis: Hypothesis, number: int = 1, of: int = 1) -> LinearisationPoint:
        """Refit a hypothesis, once, and score it there; `number` `of` so many, for who waits."""
        if hypothesis not in self.points:
            name = f"refitting {' + '.join(hypothesis)}"
            self.say(Stage(name, number, of) if of > 1 else name)
            fit = refit(self.problem, hypothesis, self._guess(hypothesis), self.base.frozen)
            self._take_secant(hypothesis, fit)
            self.points[hypothesis] = self._point(hypothesis, fit)
            self._thetas[hypothesis] = fit.theta
        return self.points[hypothesis]

    def _take_secant(self, hypothesis: Hypothesis, fit: Fit) -> None:
        """A refitted effect counts by its secant: far from nothing its slope promises too much."""
        problem, (effect, *others) = self.problem, hypothesis
        candidate = problem.candidates[effect]
        if others or not problem.moves or problem.is_straight(candidate.key):
            return
        size = fit.theta[candidate.key] - candidate.lead.off
        if abs(size) > FAR_OFF * candidate.lead.size:
            own = set(candidate.keys())
            absent = {k: v for k, v in fit.theta.items() if k not in own}
            change = problem.residual(fit.theta) - problem.residual(absent)
            self.base.jacobian[:, self.base.point.linear.index(candidate.key)] = change / size
            self._secants = True

    def _point(self, hypothesis: Hypothesis, fit: Fit) -> LinearisationPoint:
        """The problem about a refit: own slopes are those of the fit, all others the null's."""
        names, base = names_of(self.problem, fit.theta), self.base
        known = {n: i for i, n in enumerate(base.point.linear.names)}
        own = {i: fit.columns[n] for i, n in enumerate(names) if n in fit.columns}
        at = [0 if i in own else known[n] for i, n in enumerate(names)]
        slopes = np.take(base.jacobian, at, axis=1)
        for i, column in own.items():
            slopes[:, i] = column
        return base.judged(hypothesis, fit, names, slopes)

    def _guess(self, hypothesis: Hypothesis) -> dict[str, float]:
        """Where a refit starts: its last result, or the linear estimate from its largest part."""
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
        """The likeliest of all refitted hypotheses, by the secants that were taken."""
        if self._secants:
            self.base.score()
            others = {h: self._point(h, p.fit) for h, p in self.points.items() if h}
            self.points, self._secants = {**others, NULL: self.base.point}, False
        count = len(self.problem.candidates)
        return max(self.points, key=lambda h: self.points[h].log_evidence + log_prior(h, count))

    def probabilities(self, dismissed: Collection[Hypothesis] = ()) -> dict[Hypothesis, float]:
        """Of all refitted hypotheses, and of the other single effects by their linear evidence;
        without the hypotheses `dismissed` as too small or as refuted by left-out data."""
        evidence = self.base.table | {h: p.log_evidence for h, p in self.points.items()}
        evidence = {h: e for h, e in evidence.items() if h not in dismissed}
        return probabilities(evidence, len(self.problem.candidates))
