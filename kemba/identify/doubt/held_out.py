"""The error of an answer on data that the fit has not seen: logs that are kept for it, or parts of
the fitted logs that are left out."""

from __future__ import annotations

from dataclasses import dataclass

from kemba.identify.doubt.cross_validation import left_out_error
from kemba.identify.evidence.search import Search
from kemba.identify.evidence.spike_slab import NULL, Hypothesis
from kemba.identify.evidence.windows import error_ratio
from kemba.identify.problem.problem import Problem, Theta


@dataclass(frozen=True)
class HeldOut:
    """Logs that are kept from the fit, with the noise that was learnt there.

    `plain`: along the motion that the model as it is makes of them. `found`: along the one that the
    model makes with which the search ended; only there do late sensors have their whole effect.
    """

    plain: Problem
    found: Problem

    @classmethod
    def beside(cls, logs: Problem, fitted: Problem) -> HeldOut:
        """`logs` as they are judged beside the fitted ones."""
        heard = logs.heard_as(fitted)
        return cls(heard, heard.relinearise(fitted.base) if fitted.base else heard)


def error(search: Search, hypothesis: Hypothesis, kept: HeldOut | None) -> float:
    """Error in units of the noise on data that the fit has not seen: the one number that sentence,
    ranking, ladder and figures show. Of the logs `kept`; without any, of left-out blocks."""
    if hypothesis == NULL and search.own:
        return error_as_it_is(search, kept)
    if kept is None:
        return left_out_error(search, hypothesis)
    return _ratio(search, kept.found, search.points[hypothesis].fit.theta)


def error_as_it_is(search: Search, kept: HeldOut | None = None) -> float:
    """Error of the model as it is along the motion that it makes of the data itself, as `compare`
    tells it; without logs `kept` of the fitted ones."""
    own = search.own or (search.problem, search.points[NULL].fit.theta)
    return _ratio(search, kept.plain if kept else own[0].heard_as(search.problem), own[1])


def _ratio(search: Search, judge: Problem, theta: Theta) -> float:
    unknown = set(judge.nuisance) - set(search.problem.nuisance)  # of sensors not seen before
    return error_ratio(judge, theta, unknown)
