"""The search: fit of the null, ranking, refits of the leaders, further effects one by one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kemba.identify.evidence.modes.rivals import fitted_anew, judged_anew, promised
from kemba.identify.evidence.noise.colour import with_learnt_colour
from kemba.identify.evidence.null_model import Baseline
from kemba.identify.evidence.point import excess
from kemba.identify.evidence.refit import Frozen, refit
from kemba.identify.evidence.refits import Refits
from kemba.identify.evidence.search_settings import SearchSettings
from kemba.identify.evidence.spike_slab import NULL, Hypothesis, log_prior
from kemba.identify.evidence.strain import stand_ins


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
        if instead := self._leaves_far_less(best):
            best = self._along(instead)
        self.say(f"first guess: {' + '.join(best) or 'nothing'}")
        return best

    def _leaves_far_less(self, best: Hypothesis) -> Hypothesis:
        """The single effect that leaves far less than the best hypothesis, if there is one.

        Along the motion that data without an effect would have, its evidence counts for less than
        that of effects which change the motion a little. Another structure is built in instead.
        """
        settings, structures = SearchSettings, self.problem.structures
        singles = [h for h in self.points if len(h) == 1 and not structures & set(h)]
        if not self.problem.moves or not singles or self.ended:
            return NULL
        error = {h: self.points[h].fitted_error for h in (best, *singles)}
        least = min(singles, key=error.__getitem__)
        far_less = excess(error[least]) < settings.far_less * excess(error[best])
        return least if error[best] > settings.structural and far_less else NULL

    def further(self, best: Hypothesis) -> Hypothesis:
        """The likeliest hypothesis, searched for from the first guess."""
        leaders = SearchSettings.leaders
        if self.problem.moves:
            return self._follow(best)
        if best != NULL:
            promising = self._promising()
            self.base.seen_from(self.points[best].fit.theta)
            self.problem = self.base.problem
            self.points = {NULL: self.base.point}
            for number, hypothesis in enumerate(promising, start=1):
                self.visit(hypothesis, number, len(promising))
            best = self._round(NULL, leaders)
        if len(best) < 2 and not self.ended:
            best = self._look_closer(best)
        return self._swap(self._grow(best)) if best else best

    def _look_closer(self, best: Hypothesis) -> Hypothesis:
        """Nothing and the likeliest single effects fitted anew, where the best of them explains
        hardly anything of an error that is no noise, and slopes at the fit of nothing are no fair
        judge: its figures are not believed, or slopes promise what modes do not show."""
        settings = SearchSettings
        error, left = (self.points[h].fitted_error for h in (NULL, best))
        if error <= settings.structural or excess(left) <= settings.unexplained * excess(error):
            return best
        evidence = {h: p.log_evidence for h, p in self.points.items() if len(h) == 1}
        likely = sorted(evidence, key=lambda h: -evidence[h])[: settings.closer]
        instead = self._try_stand_ins(NULL)
        promise = max(promised(self.base, self.points[h]) for h in (NULL, best))
        if not instead and promise <= settings.promise:
            return best
        self.say("fitting nothing anew")
        points = {h: self.points[h] for h in (NULL, *likely, *instead)}
        fits = fitted_anew(self.base, points, lambda: self.ended, self.say)
        self.points = dict(judged_anew(self.base, points, fits))
        self.thorough = True
        return self.best()

    def _follow(self, best: Hypothesis) -> Hypothesis:
        """Repeat the search along the motion that the best hypothesis makes of the data, until the
        best hypothesis stays the same.

        An effect that changes the motion much is underrated along the first motion. So where no
        refit is better than nothing, the linear evidence may choose the hypothesis to follow.
        """
        settings = SearchSettings
        for _ in range(settings.followed):
            guess = best or self._first_of_table()
            if guess == NULL or self.ended:
                return best
            best = self._along(guess)
            if best in (guess, NULL):
                break
        return self._swap(self._regrow(self._grow(best))) if best else best

    def _along(self, guess: Hypothesis) -> Hypothesis:
        """The best single effect along the motion that a guess makes of the data."""
        self.say(f"searching again with {' + '.join(guess)} in the model")
        among = self._contenders()
        self.start(among, self._settle(guess))
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
            self.start(frozenset(), self._settle(best))
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

    def _contenders(self) -> frozenset[Hypothesis]:
        """Single effects that were refitted, or whose linear evidence gains a good share of the
        best."""
        null = self.points[NULL].log_evidence
        gains = {h: e - null for h, e in self.base.table.items() if len(h) == 1}
        least = SearchSettings.promising * max(gains.values())
        return frozenset(h for h, gain in gains.items() if gain > least or h in self.points)

    def _first_of_table(self) -> Hypothesis:
        """Of the refitted single effects the one with the largest linear evidence, if that beats
        nothing."""
        count = len(self.problem.candidates)
        null = self.points[NULL].log_evidence + log_prior(NULL, count)
        tables = {h: e for h, e in self.singles().items() if h in self.points}
        first = max(tables, key=tables.__getitem__, default=NULL)
        better = first and tables[first] + log_prior(first, count) > null
        return first if better else NULL

    def start(
        self, among: frozenset[Hypothesis] | None = None, theta: Mapping[str, float] | None = None
    ) -> None:
        """Null fit, noise colour, and the linear table at the null; `theta`: the best guess."""
        if self.problem.moves:
            about = theta or self.begin
            self.problem = with_learnt_colour(self.problem, about, careful=bool(theta))
        self.base = Baseline(self.problem, among, theta or self.begin)
        self.problem = self.base.problem
        self.points = {NULL: self.base.point}

    def _round(self, given: Hypothesis, leaders: int, least: float = -np.inf) -> Hypothesis:
        """Refit `given` with one more effect, the likeliest ones whose linear evidence is `least`
        or more; the best of all points so far. Where a refit shows a better mode for all, once
        more."""
        self._refit_leaders(given, leaders, least)
        if not self.problem.moves and self.share_modes():
            self._refit_leaders(given, leaders, least)
            self.share_modes()
        if given == NULL:
            self._try_stand_ins(self.best())
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

    def _try_stand_ins(self, hypothesis: Hypothesis) -> list[Hypothesis]:
        """Refit the effects that may stand behind nominal figures which a hypothesis moves too far;
        those that are refitted."""
        begun = stand_ins(self.points[hypothesis], self.problem)
        for effect, start in begun.items():
            if self.ended:
                break
            self._thetas.setdefault(effect, start)
            self.visit(effect)
        return [effect for effect in begun if effect in self.points]

    def _extensions(self, given: Hypothesis) -> dict[Hypothesis, float]:
        """Linear evidence of `given` plus one effect. The members of a pair that is much better
        than any single effect count as much as the best single effect."""
        if given != NULL:
            ranker = self.base.ranker(self.points[given].mode.linear)
            return ranker.table((len(given) + 1,), given=given)
        single = self.singles()
        base = max(single.values())
        pairs = [h for h in self.base.table if len(h) == 2]
        best_pair = max(pairs, key=self.base.table.__getitem__, default=NULL)
        if best_pair and self.base.table[best_pair] > base + SearchSettings.gain:
            for name in best_pair:
                single[(name,)] = max(single[(name,)], base)
        return single

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
