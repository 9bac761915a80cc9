"""The search: fit of the null, ranking, refits of the leaders, further effects one by one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kemba.identify.evidence.noise.colour import with_learnt_colour
from kemba.identify.evidence.null_model import Baseline
from kemba.identify.evidence.refit import Frozen, refit
from kemba.identify.evidence.refits import Refits
from kemba.identify.evidence.search_settings import SearchSettings
from kemba.identify.evidence.spike_slab import NULL, Hypothesis


@dataclass
class Search(Refits):
    """Which hypotheses are refitted, and in which order; `run` fills it."""

    def run(self) -> Hypothesis:
        """The likeliest hypothesis; everything that was refitted stays in `points`."""
        return self.further(self.first())

    def first(self) -> Hypothesis:
        """The first guess: the best of the single effects that look best."""
        self.say("fitting the model as it is, and a slope for every effect")
        self.start()
        best = self._round(NULL, SearchSettings.leaders)
        self.say(f"first guess: {' + '.join(best) or 'nothing'}")
        return best

    def further(self, best: Hypothesis) -> Hypothesis:
        """The likeliest hypothesis, searched for from the first guess."""
        if self.problem.moves:
            return self._follow(best)
        if best != NULL:
            promising = self._promising()
            self.base.seen_from(self.points[best].fit.theta)
            self.problem = self.base.problem
            self.points = {NULL: self.base.point}
            for number, hypothesis in enumerate(promising, start=1):
                self.visit(hypothesis, number, len(promising))
            best = self._round(NULL, SearchSettings.leaders)
        return self._swap(self._grow(best)) if best else best

    def _follow(self, best: Hypothesis) -> Hypothesis:
        """Repeat the search along the motion that the best hypothesis makes of the data, until the
        best hypothesis stays the same."""
        for _ in range(SearchSettings.followed):
            if best == NULL or self.ended:
                return best
            before, best = best, self._along(best)
            if best == before:
                break
        return self._swap(self._regrow(self._grow(best))) if best else best

    def _along(self, guess: Hypothesis) -> Hypothesis:
        """The best single effect along the motion that a guess makes of the data."""
        self.say(f"searching again with {' + '.join(guess)} in the model")
        self.start(self._settle(guess))
        self.visit(guess)
        return self._round(NULL, SearchSettings.leaders)

    def _regrow(self, best: Hypothesis) -> Hypothesis:
        """Find the motion again with an answer of several effects, and let it grow from there.

        Each effect that joins changes the motion, and with it what the others seem to be.
        """
        for _ in range(SearchSettings.regrown):
            if len(best) < 2 or self.ended:
                break
            before = best
            self.say(f"searching again with {' + '.join(best)} in the model")
            self.start(self._settle(best))
            self.visit(best)
            best = self._grow(best)
            if best == before:
                break
        return best

    def _settle(self, hypothesis: Hypothesis) -> Mapping[str, float]:
        """Find the motion that a hypothesis makes of the data, until late sensors stay as late; the
        best theta there."""
        settings, theta = SearchSettings, self.points[hypothesis].fit.theta
        asked = self.problem
        for _ in range(settings.settled):
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
            if moved < settings.still * self.problem.interval:
                break
        return theta

    def start(self, theta: Mapping[str, float] | None = None) -> None:
        """Null fit, noise colour, and the linear table at the null; `theta`: the best guess."""
        if self.problem.moves:
            about = theta or self.begin
            self.problem = with_learnt_colour(self.problem, about, careful=bool(theta))
        self.base = Baseline(self.problem, theta or self.begin)
        self.problem = self.base.problem
        self.points = {NULL: self.base.point}

    def _round(self, given: Hypothesis, leaders: int, least: float = -np.inf) -> Hypothesis:
        """Refit `given` with one more effect, the likeliest ones whose linear evidence is `least`
        or more; the best of all points so far."""
        self._refit_leaders(given, leaders, least)
        if given == NULL and self.points[NULL].fitted_error > SearchSettings.structural:
            for structure in sorted(self.problem.structures):
                self.visit((structure,))
        return self.best()

    def _refit_leaders(self, given: Hypothesis, leaders: int, least: float) -> None:
        settings = SearchSettings
        table = self._extensions(given)
        order = sorted(table, key=lambda h: -table[h])[:leaders]
        gain = table[order[0]] - self.points[given].log_evidence
        reach = max(settings.far, settings.far_share * gain)
        sure = settings.sure_grown if given else settings.sure
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

    def _extensions(self, given: Hypothesis) -> dict[Hypothesis, float]:
        """Linear evidence of `given` plus one effect."""
        if given == NULL:
            return self.singles()
        ranker = self.base.ranker(self.points[given].mode.linear)
        return ranker.table((len(given) + 1,), given=given)

    def _grow(self, best: Hypothesis) -> Hypothesis:
        """Add effects, one by one, while the evidence grows."""
        settings = SearchSettings
        while len(best) < settings.largest and not self.ended:
            grown = self._round(best, settings.leaders_grown)
            if grown == best or len(grown) <= len(best):
                break
            best = grown
        return best

    def _swap(self, best: Hypothesis) -> Hypothesis:
        """Take each effect away, or swap it for another; what was swapped may grow again."""
        settings = SearchSettings
        for _ in range(settings.swapped):
            before = best
            for member in best if len(best) > 1 else ():
                if self.ended:
                    return self.best()
                rest = tuple(h for h in best if h != member)
                self.visit(rest)
                least = self.points[best].log_evidence - settings.far
                self._round(rest, settings.leaders_swapped, least)
            best = self.best()
            if best == before or self.ended:
                break
            best = self._grow(best)
        return best

    def _promising(self) -> list[Hypothesis]:
        """Refitted hypotheses that gained a good share of what the best one gained."""
        null = self.points[NULL].log_evidence
        gains = {h: p.log_evidence - null for h, p in self.points.items() if h}
        least = SearchSettings.promising * max(gains.values())
        return [h for h, gain in gains.items() if gain > least]
