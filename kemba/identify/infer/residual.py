"""What an answer leaves: error that repeats itself, parameters that differ between runs, patterns
of force; and what to measure next."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from kemba.identify.compare.bins import BinSettings
from kemba.identify.compare.compare import conditions
from kemba.identify.compare.force_profiles import ForceProfileSettings, force_profiles
from kemba.identify.compare.hints import lacking
from kemba.identify.compare.words import place_of
from kemba.identify.infer.cross_validation import within_tolerance
from kemba.identify.infer.search import Search
from kemba.identify.infer.spike_slab import NULL, Hypothesis, SpikeSlabSettings
from kemba.identify.problem.problem import Array, Labels
from kemba.units import short

# When a parameter differs from run to run.
CLEAR = 100.0  # gain of a value per run over one value for all that is asked for [nats]
SHARE_OF_ROWS = 0.01  # the same per row of the logs [nats]
SHARE = 0.1  # the same as a share of the gain of the answer itself
SPREAD = 1.2  # sizes between the smallest and the largest value
FORGIVEN = 0.15  # error of a run, in sigmas of one row, that all its rows may share
INFORMED = 0.2  # a run is asked where it gives the parameter with this sigma, in sizes


@dataclass(frozen=True)
class Drift:
    """A parameter whose values per run contradict each other.

    `values`: one per run that tells the parameter [its unit]; `nats`: gain of these over one value.
    """

    effect: str
    key: str
    values: tuple[float, ...]
    nats: float

    def __str__(self) -> str:
        listed = ", ".join(f"{v:.3g}" for v in self.values)
        return f"{self.key} differs from run to run: {listed}"


def drifting(search: Search, best: Hypothesis) -> Drift | None:
    """The clearest case of a parameter that differs, in the error that the best answer leaves."""
    spike = SpikeSlabSettings.spike
    problem, point = search.problem, search.points[best]
    if len(problem.runs) < 2:
        return None
    run = problem.rows().run
    residual = search.base.residual
    if best:
        residual = problem.residual(point.fit.theta)
    else:  # nominal figures within their tolerance
        z = within_tolerance(search, point.linear, NULL)
        residual = residual + search.base.jacobian @ (z - point.linear.at)
    gained = point.log_evidence - search.points[()].log_evidence
    count = np.bincount(run)
    found: list[Drift] = []
    for effect, candidate in problem.candidates.items():
        column = search.base.jacobian[:, search.points[()].linear.index(candidate.key)]
        gram, slope = (np.bincount(run, column * other) for other in (column, residual))
        error = (1.0 + FORGIVEN**2 * count) / np.maximum(gram, 1e-12)
        keep = error < (INFORMED * candidate.lead.size) ** 2
        if keep.sum() < 2:
            continue
        gram, slope = gram[keep], slope[keep]
        narrow = error[keep] + (spike * candidate.lead.size) ** 2
        own = -slope / gram
        shared = float(np.sum(own / narrow) / np.sum(1.0 / narrow))
        nats = 0.5 * float(np.sum((own - shared) ** 2 / narrow))
        if np.ptp(own) > SPREAD * candidate.lead.size:
            values = tuple(float(candidate.lead.off + a) for a in own)
            found.append(Drift(effect, candidate.key, values, nats))
    least = max(CLEAR, SHARE * gained, SHARE_OF_ROWS * len(residual))
    return max((d for d in found if d.nats >= least), key=lambda d: d.nats, default=None)


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
    r = np.clip(left_over.residual, -CLIP, CLIP)
    columns = left_over.features
    columns = columns / np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-9)
    folds = np.zeros(len(r), dtype=int)  # blocks of time of each run, dealt out in turn
    for run in np.unique(left_over.run):
        own = np.flatnonzero(left_over.run == run)
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
    settings, problem = ForceProfileSettings, search.problem
    found = force_profiles(problem, problem.residual(point.fit.theta))
    plain = [force for force in found if force.largest > settings.negligible * force.usual]
    first = max(plain, key=lambda force: force.gain, default=None)
    gained = point.log_evidence - search.points[NULL].log_evidence
    least = max(settings.plain, LEFT * gained)
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
    rest = "; ".join([*worst, *law]) or "no condition in particular"
    if unsure:
        named = " and ".join(unsure)
        told = f"'kemba-opt experiment' proposes a test that tells {named} from what looks alike"
        return rest, told
    if not problem.moves:
        model = getattr(problem, "model", None)
        return rest, STROKES if model is None else ON_RIGS.get(model.mechanism.rig, STROKES)
    parts = channel.replace(" ", "/").split("/")
    return rest, next((text for key, text in NEXT.items() if key in parts), BODY)
