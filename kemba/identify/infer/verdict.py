"""What may be said of a finished search: why its answer is not complete, and the verdict."""

from dataclasses import dataclass

from kemba.effects.rigs.axis import DriveAxis
from kemba.errors import enumerated
from kemba.identify.answer import ENDED, Ranked, Verdict, VerdictSettings
from kemba.identify.infer.cross_validation import HeldOut, error
from kemba.identify.infer.formula import Formula
from kemba.identify.infer.joint import RIG_FIGURES, JointFit, given_figure
from kemba.identify.infer.ranking import values
from kemba.identify.infer.residual import Drift, explains_structure, pattern_left, unfinished
from kemba.identify.infer.search import Search
from kemba.identify.infer.selection import Selection
from kemba.identify.infer.spike_slab import NULL, Hypothesis
from kemba.identify.infer.windows import excess
from kemba.identify.logs.gate import unit_in_doubt
from kemba.identify.problem.sensor_faults import is_fault
from kemba.model.model import Model

# gains that no sensor and no motor has, least and largest: a sensor's is off by ten times its usual
# error there, a motor's force is known to 10 %
SENSOR, MOTOR = (-0.2, 0.2), (0.5, 2.0)
DRIVEN = {"axis_scale": "axis/tau", "torque_scale": "hip/tau"}
PLATE = 3.0  # factor by which no figure of a rig is off: feet for metres are 3.28
HEAVY = 10.0  # inertia that was forgotten, over the one that is known: gears and rotors have less


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
    unsure = _unasked(search, best) if ended else ()
    if unsure and not reasons:
        return Caveats((ENDED,), part=True, unsure=unsure)
    return Caveats(tuple(reasons), part, unsure)


def implausible(search: Search, found: Hypothesis, joint: JointFit | None) -> tuple[str, ...]:
    """What to say of effects, and of figures of a rig, that are farther off than any is: a channel
    has another unit. By the `joint` fit, where there is one."""
    problem, said = search.problem, dict[str, None]()
    model: Model | None = getattr(problem, "model", None)
    for effect in found:
        kind, _, channel = effect.partition(":")
        told = joint.values(problem.candidates[effect]) if joint else values(search, found, effect)
        gain, limits = told["k"].value if "k" in told else 0.0, SENSOR
        if kind in DRIVEN:
            channel, limits = DRIVEN[kind], MOTOR
        if kind in ("sensor_scale", *DRIVEN) and not limits[0] <= gain <= limits[1]:
            whose = "motor" if kind in DRIVEN else "sensor"
            off = f"the gain of {channel} would be off by more than any {whose}'s is"
            said[f"{off}; its unit is wrong, or its scale or offset in a map (--map)"] = None
        if kind == "extra_inertia" and model is not None:
            axis = model.effect("drive_axis")
            assert isinstance(axis, DriveAxis)
            times = abs(told["J"].value) / axis.inertia
            said |= dict.fromkeys(_of_rig(kind, times, times < HEAVY))
        if (
            model
            and model.mechanism.rig == "cylinder"
            and any("m" in v.unit for v in told.values())
        ):
            at = problem.operating_point()
            if doubted := unit_in_doubt(at.x, at.stroke):
                said[f"{doubted}; if it did not, `stroke` of the model may be what it moves"] = None
    for figure, value in (joint.figures if joint else {}).items():
        if joint and model and figure in RIG_FIGURES:
            given = given_figure(model, *figure.rsplit(".", 1))
            low, high = (
                ends[joint.names.index(figure)] / given for ends in (joint.low, joint.high)
            )
            said |= dict.fromkeys(
                _of_rig(figure, value / given, low < PLATE and high > 1.0 / PLATE)
            )
    return tuple(said)


def _of_rig(name: str, times: float, right: bool) -> list[str]:
    """That a figure is so many times the one given, unless that is `right`."""
    units = "the unit of a channel is wrong (--map), or the rig's figures in the model"
    said = f"{name} would be {times:.3g} times what the rig is said to have; {units}"
    return [] if right else [said]


def _unasked(search: Search, best: Hypothesis) -> Hypothesis:
    """Effects of an ended search's answer that nothing else was asked for: smaller answers, and
    sensors that drift instead of being wrong, come last."""
    asked_smaller = len(best) == 1 or not search.late
    return tuple(e for e in best if is_fault(e)) if asked_smaller else best


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
