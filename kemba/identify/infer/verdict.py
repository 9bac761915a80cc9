"""What may be said of a finished search: why its answer is not complete, and the verdict."""

from dataclasses import dataclass

from kemba.errors import enumerated
from kemba.identify.answer import ENDED, Ranked, Verdict, VerdictSettings
from kemba.identify.infer.cross_validation import HeldOut, error
from kemba.identify.infer.formula import Formula
from kemba.identify.infer.ranking import values
from kemba.identify.infer.residual import Drift, explains_structure, pattern_left, unfinished
from kemba.identify.infer.search import Search
from kemba.identify.infer.selection import Selection
from kemba.identify.infer.spike_slab import NULL, Hypothesis
from kemba.identify.infer.windows import excess
from kemba.identify.problem.sensor_faults import is_fault

GROSS = 0.2  # error of a gain that is another unit, and no sensor's: ten times its usual size
MOTOR = 2.0  # the same of the factor by which a motor's force is off, which is known to 10 %


@dataclass(frozen=True)
class Caveats:
    """Why an answer is not complete. `part`: it explains enough of the error to be a part;
    `unsure`: effects of it that are likely at best, whatever their probability."""

    reasons: tuple[str, ...] = ()
    part: bool = False
    unsure: Hypothesis = ()


def caveats_of(
    search: Search,
    selection: Selection,
    drift: Drift | None,
    kept: HeldOut | None,
    ended: bool = False,
) -> Caveats:
    """Why the best answer cannot be complete, and whether it is a part of one; `ended`: the time
    was over before the search was."""
    settings, reasons, best = VerdictSettings, [], selection.best
    if gross := _other_units(search, best):
        return Caveats(gross)
    before, after = (error(search, h, kept) for h in (NULL, best))
    least = settings.part
    if drift is not None:
        reasons.append(str(drift))
        least = settings.part_of_structure
    elif unfinished(search, best):
        reasons.append("the error that is left repeats itself with motion and valves")
        least = settings.part_of_structure
    elif pattern := pattern_left(search, best):
        reasons.append(f"the error that is left has a pattern: {pattern}")
        if not explains_structure(search, best):
            least = settings.part_of_structure
    if drift is None and after <= settings.whole:
        least = settings.part  # a whole answer may leave as much
    if ended and after > settings.whole:
        reasons.append(ENDED)
        least = 0.0  # however little it explains, nothing else could be asked
    if best and after > settings.whole and excess(after) > settings.whole_share * excess(before):
        leaves = f"leaves an error of {after:.3g} times the noise"
        reasons.append(f"{enumerated(best)} fits best, but {leaves}")
    if not best and selection.p_value <= settings.unexplained and before > settings.whole:
        leaves = f"the model as it is leaves an error of {before:.3g} times the noise"
        reasons.append(f"{leaves}, and no effect explains enough of it")
    if selection.rivals:
        others = ", ".join(" + ".join(h) for h in selection.rivals)
        reasons.append(f"{others} would predict left-out data as well as {' + '.join(best)}")
    part = bool(best) and excess(after) <= (1.0 - least) * excess(before)
    unsure = best if ended else ()  # smaller answers, and sensors that drift instead, come last
    if len(best) == 1 or not search.late:
        unsure = tuple(e for e in unsure if is_fault(e))
    if unsure and not reasons:
        return Caveats((ENDED,), part=True, unsure=unsure)
    return Caveats(tuple(reasons), part, unsure)


def _other_units(search: Search, best: Hypothesis) -> tuple[str, ...]:
    """What to say of sensors and motors whose gain would be off by more than that of any is."""
    gains: dict[str, str] = {}
    for effect in best:
        kind, _, channel = effect.partition(":")
        if kind == "sensor_scale" and abs(values(search, best, effect)["k"].value) > GROSS:
            gains[channel] = "sensor"
        torque = {"axis_scale": "axis/tau", "torque_scale": "hip/tau"}.get(kind)
        if torque and not 1 / MOTOR < values(search, best, effect)["k"].value < MOTOR:
            gains[torque] = "motor"
    return tuple(
        f"the gain of {channel} would be off by more than any {what}'s is; its unit is wrong, or "
        "its scale or offset in a map (--map)"
        for channel, what in gains.items()
    )


def verdict_on(best: Hypothesis, formula: Formula | None, caveats: Caveats) -> Verdict:
    """Missing, where the answer is complete; partly, where it explains enough of the error."""
    if formula is not None or (caveats.reasons and not caveats.part):
        return "unknown"
    if not best:
        return "nothing"
    return "partly" if caveats.reasons else "missing"


def is_sure(ranked: Ranked) -> bool:
    """Whether an effect is likely enough to be added to a model, and nothing could stand for it."""
    return ranked.probability >= VerdictSettings.sure and not ranked.equivalent_to
