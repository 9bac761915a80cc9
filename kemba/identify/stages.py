"""Answers in two stages: another structure first, then what the model with that structure lacks.

With another structure every effect reads other states, and the motion that is found in the logs
changes. So the problem is built anew on the model with the new structure, and searched again.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import expit

from kemba.identify.answer import Answer, Ranked, Value, Verdict, phrase
from kemba.identify.doubt.cross_validation import left_out
from kemba.identify.evidence.point import excess
from kemba.identify.evidence.search import Search
from kemba.identify.evidence.spike_slab import Hypothesis, share_of
from kemba.identify.rest import rest_of
from kemba.identify.settings import VerdictSettings
from kemba.identify.written.joint import JointFit


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
    gain = left_out(first, _likeliest_with(first, structure)).nats
    return Ranked(structure, share, values, (), *errors, gain)


def _likeliest_with(search: Search, effect: str) -> Hypothesis:
    """The likeliest hypothesis that has this effect."""
    having = [h for h in search.points if effect in h]
    return max(having, key=lambda h: search.points[h].log_evidence)


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
        left = rest_of(second, best, [])
        found.rest, found.next = left.where, left.next
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
