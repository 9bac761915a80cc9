"""What may be said of a finished search: the effects in order of probability, with their parameters
and equivalents; why the answer is not complete (error that repeats itself, patterns of force); the
verdict, and what to measure next.
"""

from collections.abc import Collection
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from kemba.effects.rigs.axis import DriveAxis
from kemba.errors import enumerated
from kemba.identify.answer import ENDED, Ranked, Value, Verdict, VerdictSettings
from kemba.identify.compare.bins import BinSettings
from kemba.identify.compare.compare import conditions
from kemba.identify.compare.force_profiles import NEGLIGIBLE, PLAIN, force_profiles
from kemba.identify.compare.hints import lacking
from kemba.identify.compare.words import place_of
from kemba.identify.infer.cross_validation import HeldOut, error, error_as_it_is, left_out
from kemba.identify.infer.formula import Formula
from kemba.identify.infer.joint import RIG_FIGURES, JointFit, given_figure
from kemba.identify.infer.linear import NULL, Hypothesis, SpikeSlabSettings, is_shape, share_of
from kemba.identify.infer.null_model import within_bounds
from kemba.identify.infer.search import Search
from kemba.identify.infer.selection import Selection, strength
from kemba.identify.infer.windows import excess
from kemba.identify.logs.gate import unit_in_doubt
from kemba.identify.problem.problem import Array, Labels
from kemba.identify.problem.sensor_faults import is_fault
from kemba.model.model import Model
from kemba.units import short

# two explanations are equivalent when their evidence differs by less [nats]: Kass and Raftery
# 1995, 'strong' evidence begins at 3 nats
SAME = 3.0
SHOWN = 8  # effects in the ranking: fits a screen
# largest probability of all effects together where nothing is significant: nothing is then the
# likeliest
DOUBTED = 0.5


def ranked(
    search: Search,
    selection: Selection,
    kept: HeldOut | None,
    whole: Hypothesis = NULL,
    joint: JointFit | None = None,
) -> list[Ranked]:
    """The effects in order of probability; those of the selected hypothesis first, then the
    others of the `whole` that is written, with what the `joint` fit says of them."""
    problem, best = search.problem, selection.best
    probability = search.probabilities(selection.dismissed if best else ())
    if not best:  # where nothing was found significant, nothing is the likeliest
        rest = sum(p for h, p in probability.items() if h)
        scale = min(1.0, DOUBTED / rest) if rest > 0 else 1.0
        probability = {h: p * scale if h else 1.0 - rest * scale for h, p in probability.items()}
    shares = share_of(probability, problem.candidates)
    order = sorted(
        shares,
        key=lambda e: (e not in best, e not in whole, -strength(search, e, best), -shares[e]),
    )
    found = []
    before = error(search, NULL, kept)
    for effect in order[: max(SHOWN, len(whole))]:
        written = joint is not None and effect in whole
        hypothesis = (whole if written else best) if effect in {*whole, *best} else NULL
        if not hypothesis:  # alone, if it was refitted; else the likeliest one that has it
            having = [h for h in search.points if effect in h]
            alone = [(effect,)] if (effect,) in having else having
            hypothesis = max(alone, key=lambda h: search.points[h].log_evidence, default=NULL)
        if not hypothesis:
            continue
        if joint is not None and written:
            told = joint.values(problem.candidates[effect])
        else:
            told = values(search, hypothesis, effect)
        alike = equivalents(search, selection, effect) if effect in best else ()
        after, gain = error(search, hypothesis, kept), left_out(search, hypothesis).nats
        found.append(Ranked(effect, shares[effect], told, alike, before, after, gain))
    return found


def equivalents(search: Search, selection: Selection, effect: str) -> tuple[str, ...]:
    """Effects that could stand in this one's place in the answer: they explain the data, or predict
    left-out data, as well."""
    hypothesis = selection.best
    own, same = search.points[hypothesis].log_evidence, SAME
    near = {h for h, p in search.points.items() if own - p.log_evidence < same}
    rest = set(hypothesis) - {effect}
    found: set[str] = set()
    for other in (near - selection.dismissed) | set(selection.rivals):
        swapped = set(other) - rest
        if len(other) == len(hypothesis) and rest <= set(other) and swapped != {effect}:
            found |= swapped
    return tuple(sorted(found))


def values(search: Search, hypothesis: Hypothesis, effect: str) -> dict[str, Value]:
    """Parameters of one effect with 95 % intervals.

    The model's own imperfection may add to an effect or hide some of it: as much, in one sigma, as
    the spike of the prior allows.
    """
    problem, candidate = search.problem, search.problem.candidates[effect]
    point, found = search.points[hypothesis], {}
    z, covariance = within_bounds(problem, point), point.score.covariance
    for key, parameter in candidate.keys().items():
        i, shape = point.linear.index(key), is_shape(problem, key)  # shapes by their logarithm
        step = 1.0 if shape else abs(z[i] - parameter.off)
        reach = 1.96 * float(np.hypot(np.sqrt(covariance[i, i]), SpikeSlabSettings.spike * step))
        triple = z[i] + reach * np.array([0.0, -1.0, 1.0])
        if shape:
            triple = np.exp(np.clip(triple, -50, 50))
        triple = np.clip(triple, parameter.lower, parameter.upper)
        name, unit = candidate.reported(parameter)
        if name != parameter.name:
            triple = 1.0 / np.maximum(triple, 1e-12)[[0, 2, 1]]
        value, low, high = triple.tolist()
        found[name] = Value(value, low, high, unit)
    return found


def rungs(search: Search, best: Hypothesis) -> list[Hypothesis]:
    """Nothing, then the effects of the best answer as they join, the strongest first; parts that
    were not refitted are passed over."""
    order = sorted(best, key=lambda e: -strength(search, e, best))
    parts = [tuple(sorted(order[: i + 1])) for i in range(len(order))]
    return [NULL, *(part for part in parts if part in search.points)]


def ladder(search: Search, best: Hypothesis, kept: HeldOut | None) -> list[tuple[str, float]]:
    """Error on unseen data at every rung, by what joins there."""
    steps, names = rungs(search, best), ["model as it is"]
    for before, after in pairwise(steps):
        names.append(" + ".join(e for e in after if e not in before))
    return [(n, error(search, step, kept)) for n, step in zip(names, steps, strict=True)]


def fitted_errors(search: Search, best: Hypothesis) -> tuple[float, ...]:
    """Error on the fitted logs at every rung of the ladder."""
    first, *others = (search.points[step].fitted_error for step in rungs(search, best))
    return (error_as_it_is(search) if search.own else first, *others)


# gains that no sensor and no motor has, least and largest: a sensor's is off by ten times its usual
# error there, a motor's force is known to 10 %
SENSOR, MOTOR = (-0.2, 0.2), (0.5, 2.0)
DRIVEN = {"axis_scale": "axis/tau", "torque_scale": "hip/tau"}
PLATE = 3.0  # factor by which no figure of a rig is off: feet for metres are 3.28
NO_INERTIA = (
    "the axis would have no inertia: something else moves it, or the rig's figures are wrong"
)
HEAVY = 10.0  # inertia that was forgotten, over the one that is known: gears and rotors have less
OF_RIG = (
    "{} would be {:.3g} times what the rig is said to have; the unit of a channel is wrong "
    "(--map), or the rig's figures in the model"
)


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
    kept: HeldOut | None,
    ended: bool = False,
) -> Caveats:
    """Why the best answer cannot be complete, and whether it is a part of one; `ended`: the time
    was over before the search was."""
    settings, reasons, best = VerdictSettings, [], selection.best
    before, after = (error(search, h, kept) for h in (NULL, best))
    least = settings.part
    if unfinished(search, best):
        reasons.append("the error that is left repeats itself with motion and valves")
        least = settings.part_of_structure
    elif pattern := pattern_left(search, best):
        reasons.append(f"the error that is left has a pattern: {pattern}")
        if not explains_structure(search, best):
            least = settings.part_of_structure
    if after <= settings.whole:
        least = settings.part  # a whole answer may leave as much
    if ended and after > settings.whole:
        reasons.append(ENDED)
        least = 0.0  # however little it explains, nothing else could be asked
    if best and not settings.is_whole(before, after):
        leaves = f"leaves an error of {after:.3g} times the noise"
        reasons.append(f"{enumerated(best)} fits best, but {leaves}")
    shows = selection.p_value <= settings.unexplained and before > settings.whole
    if not best and (shows or before > settings.plain):
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
    if best and not reasons and round(after, 2) >= round(before, 2):  # as it is quoted
        same = f"{enumerated(best)} leaves the error at {before:.2f} times the noise, as it was"
        return Caveats((same,), part=True, unsure=best)
    return Caveats(tuple(reasons), part, unsure)


def implausible(search: Search, found: Hypothesis, joint: JointFit | None) -> tuple[str, ...]:
    """What to say of effects, and of figures of a rig, that are farther off than any is: a channel
    has another unit. By the `joint` fit, where there is one."""
    problem, said = search.problem, list[str]()
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
            said.append(f"{off}; its unit is wrong, or its scale or offset in a map (--map)")
        if model is None:
            continue
        if kind == "extra_inertia":
            axis = model.effect("drive_axis")
            assert isinstance(axis, DriveAxis)
            times = told["J"].value / axis.inertia
            said += [OF_RIG.format(kind, times)] if times >= HEAVY else []
            said += [NO_INERTIA] if times <= -1.0 else []
        if model.mechanism.rig == "cylinder" and any("m" in v.unit for v in told.values()):
            at = problem.operating_point()
            if doubted := unit_in_doubt(at.x, at.stroke):
                said.append(f"{doubted}; if it did not, `stroke` of the model may be what it moves")
    for figure, value in joint.figures.items() if joint and model else ():
        if joint and model and figure in RIG_FIGURES:
            given = given_figure(model, *figure.rsplit(".", 1))
            i = joint.names.index(figure)
            if joint.low[i] / given >= PLATE or joint.high[i] / given <= 1.0 / PLATE:
                none = figure == "drive_axis.J" and value <= given / HEAVY
                said.append(NO_INERTIA if none else OF_RIG.format(figure, value / given))
    return tuple(dict.fromkeys(said))


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


# When error that repeats itself tells that something is missing.
STRUCTURE = 1.0  # repeatable mean square, in noise units, that an imperfect model may leave
LEFT = 0.1  # the same as a share of what the answer explains
CLIP = 30.0  # residuals are clipped at so many sigmas
RIDGES = (1e-4, 1e-2, 1.0)  # penalties of the regression that are tried
FOLDS = 5  # blocks of time that are left out in turn: five


def _structured(search: Search, hypothesis: Hypothesis) -> tuple[float, float]:
    """Mean square of the residual in noise units, and the part that other folds predict."""
    left_over = search.problem.leftover(search.points[hypothesis].fit.theta)
    if left_over is None:
        return 1.0, 0.0
    residual, columns, runs = left_over
    r = np.clip(residual, -CLIP, CLIP)
    columns = columns / np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-9)
    folds = np.zeros(len(r), dtype=int)  # blocks of time of each run, dealt out in turn
    for run in np.unique(runs):
        own = np.flatnonzero(runs == run)
        folds[own] = np.arange(len(own)) * 2 * FOLDS // len(own) % FOLDS
    power = float(np.mean(r**2))
    left = min(float(np.mean((r - _predicted_folds(r, columns, folds, k)) ** 2)) for k in RIDGES)
    return power, max(power - left, 0.0)


def _predicted_folds(r: Array, columns: Array, folds: Labels, ridge: float) -> Array:
    """Residual (n,) that a ridge regression on the other folds predicts for each."""
    predicted = np.zeros(len(r))
    for fold in np.unique(folds):
        out = folds == fold
        a, b = columns[~out], r[~out]
        h = a.T @ a + ridge * len(a) * np.eye(a.shape[1])
        predicted[out] = columns[out] @ np.linalg.solve(h, a.T @ b)
    return predicted


def unfinished(search: Search, best: Hypothesis) -> bool:
    """Whether so much structure is left that the answer cannot be complete."""
    power, structure = _structured(search, best)
    if not best or structure <= STRUCTURE:
        return structure > STRUCTURE
    before, _ = _structured(search, NULL)
    return structure > LEFT * max(before - power, 0.0)


def explains_structure(search: Search, best: Hypothesis) -> bool:
    """Whether an answer leaves hardly any of the error that repeats itself without it: of a lost
    force of 20 N 0.4 %, of a wrong supply that stands for something else all of it."""
    before, after = (_structured(search, h)[1] for h in (NULL, best))
    return after < LEFT * before


BENCH = "run this cylinder alone on a rig: slow strokes, fast strokes, and the rod locked"
NEXT = {  # by the end of a channel's name
    "piston": BENCH,
    "rod": BENCH,
    "hip": "swing this hip in the air with closed valves, slowly and fast",
    "pitch": "tilt the body by hand in the air, and let it drop with the legs at rest",
}
BODY = "let the robot drop with the legs at rest, and move the boom by hand"
ON_RIGS = {  # by the kind of rig of the model; a piston of the robot on its bench has none
    "drive": "move the axis slowly and fast, to and fro, with and without load",
    "vessel": "fill and empty the vessel from several pressures",
}
STROKES = "move the rod slowly and fast over its whole stroke, hold it between, at other pressures"


def pattern_left(search: Search, best: Hypothesis) -> str:
    """A force that the best hypothesis leaves and that goes with speed, place, load or a command,
    in words; empty where none explains a fair share of what the hypothesis itself explains.

    A force is no pattern where it is negligible. What it explains is held against the scatter that
    is left, and not against the noise alone: noise of another colour than was learnt goes with many
    things a little.
    """
    point = search.points[best]
    if not best or point.fitted_error < BinSettings.tolerated:
        return ""
    problem = search.problem
    found = force_profiles(problem, problem.residual(point.fit.theta))
    plain = [force for force in found if force.largest > NEGLIGIBLE * force.usual]
    first = max(plain, key=lambda force: force.gain, default=None)
    gained = point.log_evidence - search.points[NULL].log_evidence
    least = max(PLAIN, LEFT * gained)
    if first is None or first.gain < least * point.fitted_error**2:
        return ""
    return str(first)


def rest_of(search: Search, best: Hypothesis, unsure: Collection[str]) -> tuple[str, str]:
    """Where the error sits that the best hypothesis leaves, and which measurement would tell more
    of it. `unsure`: effects in it that have rivals."""
    problem, theta = search.problem, search.points[best].fit.theta
    profiles = force_profiles(problem, problem.residual(theta))
    law = [hint.text for hint in lacking(profiles)]
    bins = sorted(conditions(problem, theta), key=lambda b: -b.ratio)
    worst = [f"{place_of(b)} ({short(b.ratio)} times the noise)" for b in bins if b.significant][:1]
    channel = profiles[0].channel if law else bins[0].channel if worst else ""
    rest = "; ".join([*worst, *law])
    if unsure:
        named = " and ".join(unsure)
        told = f"'kemba-opt experiment' proposes a test that tells {named} from what looks alike"
        return rest, told
    if not problem.moves:
        model = getattr(problem, "model", None)
        return rest, STROKES if model is None else ON_RIGS.get(model.mechanism.rig, STROKES)
    parts = channel.replace(" ", "/").split("/")
    return rest, next((text for key, text in NEXT.items() if key in parts), BODY)
