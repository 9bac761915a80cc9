"""Small effects that an answer wants: left-out data are predicted worse without them.

Evidence lets every effect that a hypothesis does not name be there with a small share of its size,
and such shares may imitate one effect more. A model that is written has none of them: what imitated
an effect there is no longer in it, and its own figures are wrong (on logs of one jump of the full
plant 25 N.s/m of piston damping instead of 15, without the 5 N of friction).

Only where the answer explains the logs to within their noise. Where more is left, left-out data ask
for whatever imitates that: of a foreign plan, with 2.9 times the noise left, the boom's force was
19 N (12 in truth) beside a spring, a rotor and a friction that are not there.
"""

from __future__ import annotations

from kemba.identify.doubt.cross_validation import left_out, left_out_error, window_powers
from kemba.identify.doubt.parsimony import as_good
from kemba.identify.evidence.search import Search
from kemba.identify.evidence.spike_slab import Hypothesis
from kemba.identify.problem.sensor_faults import is_fault
from kemba.identify.settings import DiscoverSettings, VerdictSettings
from kemba.settings import Settings, setting


class WantingSettings(Settings):
    """When an effect is named that the prior on many effects is against."""

    strong: float = setting(
        5.0,
        "nats",
        "evidence for an effect, without that prior, from which left-out data may ask for it",
        "literature: strong evidence by Kass and Raftery 1995; of the names in the blind studies "
        "with less all twelve were wrong, with 5 nats or more five of seven right",
        decides=True,
    )


def fuller(search: Search, best: Hypothesis) -> Hypothesis:
    """The best hypothesis with the further effects that left-out data ask for most, one by one, of
    those that were refitted."""
    larger = [h for h in search.points if set(best) < set(h) and len(h) == len(best) + 1]
    asked = [h for h in larger if is_asked(search, h, best)]
    if not asked:
        return best
    return fuller(search, min(asked, key=lambda h: window_powers(search, h).sum()))


def wanted(search: Search, hypothesis: Hypothesis, effect: str, share: float) -> bool:
    """Whether left-out data ask for an effect of a hypothesis, whose `share` of its size would
    matter alone but is small beside a stronger one."""
    rest = tuple(e for e in hypothesis if e != effect)
    if not rest or share < DiscoverSettings.current().matters:
        return False
    if rest not in search.points and search.late:
        return False
    search.visit(rest)
    return is_asked(search, hypothesis, rest)


def is_asked(search: Search, larger: Hypothesis, smaller: Hypothesis) -> bool:
    """Whether the larger hypothesis explains left-out data, and these speak for it by more than
    their scatter, in rows and summed over aggregation windows.

    Evidence must be strong for it, too, but for the prior, by which every further effect is
    unlikely. Never for a faulty sensor: a scale of 2 % took what a late sensor left over between
    rows.
    """
    gain = search.points[larger].log_evidence - search.points[smaller].log_evidence
    if gain < WantingSettings.current().strong:
        return False
    faulty = any(is_fault(effect) for effect in larger if effect not in smaller)
    if faulty or left_out_error(search, larger) > VerdictSettings.current().whole:
        return False
    return left_out(search, larger, smaller).pays and not as_good(search, smaller, larger)
