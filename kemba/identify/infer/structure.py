"""Another structure: its figures fitted first, then what the model with that structure lacks.

With another structure every effect reads other states, and the motion that is found in the logs
changes. So the problem is built anew on the model with the new structure, and searched again.
Predictions bend with orifices, volumes and pressures, so that one linear step from their usual
values leads anywhere: the fit of the figures goes by bounded steps that are taken only where the
innovations become likelier, and the motion is found again in between.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import expit

from kemba.identify.answer import Answer, Ranked, Value, Verdict, VerdictSettings, phrase
from kemba.identify.infer.cross_validation import left_out
from kemba.identify.infer.joint import JointFit
from kemba.identify.infer.linear import NULL, Hypothesis, linearise, names_of, share_of, time_blocks
from kemba.identify.infer.refit import Frozen, refit
from kemba.identify.infer.search import Search
from kemba.identify.infer.verdict import rest_of
from kemba.identify.infer.windows import error_ratio, excess
from kemba.identify.problem.problem import Problem

ROUNDS = 4  # times that the figures are fitted along a motion
GAIN = 0.02  # share of the error that another round must take away
AHEAD = 100.0  # gain from which another structure is built in, every effect free in both [nats]


@dataclass(frozen=True)
class Rebuilt:
    """A problem built anew with another structure, its figures, and the `nats` by which it is ahead
    of the model as it is, with every effect free in both."""

    problem: Problem
    figures: Mapping[str, float]
    nats: float = 0.0


def fitted_figures(problem: Problem) -> tuple[Problem, dict[str, float]]:
    """The problem along the motion that its best figures make of the data, and these figures."""
    free = tuple(problem.nuisance)
    best, figures, least, found = problem, dict[str, float](), np.inf, dict[str, float]()
    for _ in range(ROUNDS):
        slopes = Frozen(free, problem.jacobian(found, free))
        found = refit(problem, NULL, found, slopes).theta
        error = error_ratio(problem, found)
        if error > least * (1.0 - GAIN):
            break
        best, figures, least = problem, found, error
        problem = problem.relinearise(found)
    return best, figures


def ahead(problem: Problem, theta: Mapping[str, float], error: float) -> Rebuilt | None:
    """The problem with another structure, where that leaves far less unexplained.

    `theta`: the first guess; where it leaves no more than `error` times the stated noise, nothing
    is asked. Noise is as stated in both: the wrong structure's error would be learnt as colour.
    """
    plain = problem.recolour(None)
    if not problem.structures or error_ratio(plain, theta) <= error:
        return None
    built, figures = fitted_figures(plain.rebuilt(theta))
    rows = min(len(plain.residual({})), len(built.residual(figures)))
    nats = rows * (_unexplained(plain, {}) - _unexplained(built, figures))
    return Rebuilt(built, figures, nats) if nats > AHEAD else None


def _unexplained(problem: Problem, theta: Mapping[str, float]) -> float:
    """Nats per row left when every effect within this structure may help, by a linear step."""
    other = {problem.candidates[name].key for name in problem.structures}
    names = [name for name in names_of(problem, theta) if name not in other]
    linear, _, r = linearise(problem, theta, time_blocks(problem), names)
    return linear.cost(linear.best()) / len(r)


def structure_row(
    first: Search,
    structure: str,
    errors: tuple[float, float],
    second: Search,
    joint: JointFit,
    nats: float,
) -> Ranked:
    """The structure in the ranking, with its figures as the second search found them.

    `errors`: of the model as it is, and with the structure alone. `nats`: by which the structure is
    ahead with every effect free; from this its probability is told where the first search, whose
    noise may have the colour of the wrong structure's error, saw less in it.
    """
    units, values = {p.name: p for p in first.problem.candidates[structure].shapes}, {}
    for key, name in second.problem.own_figures.items():
        i, p = joint.names.index(key), units[name]
        triple = np.clip((joint.value[i], joint.low[i], joint.high[i]), p.lower, p.upper)
        value, low, high = triple.tolist()
        values[name] = Value(value, low, high, p.unit)
    share = share_of(first.probabilities(), [structure])[structure]
    share = max(share, float(expit(nats)) if nats > 0.0 else 0.0)
    gain = left_out(first, (structure,)).nats
    return Ranked(structure, share, values, (), *errors, gain)


def joined(row: Ranked, p_value: float, answer: Answer, second: Search, best: Hypothesis) -> Answer:
    """The answer of the second search as one about the model as it was.

    `row`: the structure in the ranking; `p_value` of nothing, of the first search.
    """
    before, after = row.error_before, answer.error_after
    verdict = _verdict(answer.verdict, before, after)
    named = verdict in ("missing", "partly")
    names, rungs = [n for n, _ in answer.ladder[1:]], [e for _, e in answer.ladder]
    steps = ["model as it is", row.effect, *names]
    found = replace(
        answer,
        verdict=verdict,
        p_value_nothing=p_value,
        ranking=[row, *answer.ranking],
        added=(row.effect, *(answer.added or best)) if named else (),
        sure=(row.effect, *answer.sure) if named else (),
        error_before=before,
        ladder=list(zip(steps, [before, *rungs], strict=True)),
    )
    if verdict == "partly" and not answer.rest:
        found.rest, found.next = rest_of(second, best, [])
    found.sentence = phrase(found)
    found.remarks = [*answer.remarks, f"built anew with {row.effect}; its figures were left free"]
    return found


def is_mixture(share: Value) -> bool:
    """Whether a structure is found as a share of the rods' force only, beside the old one: a model
    has it whole, and is another one."""
    return not share.low <= 1.0 <= share.high


def _verdict(second: Verdict, before: float, after: float) -> Verdict:
    """What the verdict on the second model says of the first, from the errors before and after."""
    settings = VerdictSettings
    share = excess(after) / max(excess(before), 1e-9)
    if second in ("missing", "nothing") and (
        after <= settings.whole or share <= settings.whole_share
    ):
        return "missing"
    least = settings.part_of_structure if second == "unknown" else settings.part
    return "partly" if share <= 1.0 - least else "unknown"
