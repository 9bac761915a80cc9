"""The error that an answer leaves: where it sits, and what to measure next."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from kemba.identify.compare.bins import BinSettings
from kemba.identify.compare.compare import conditions
from kemba.identify.compare.force_profiles import ForceProfileSettings, force_profiles
from kemba.identify.compare.hints import lacking
from kemba.identify.compare.words import place_of
from kemba.identify.doubt.unexplained import UnexplainedSettings
from kemba.identify.evidence.search import Search
from kemba.identify.evidence.spike_slab import NULL, Hypothesis
from kemba.identify.problem.problem import Problem
from kemba.units import short

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


@dataclass(frozen=True)
class Remainder:
    """Where the rest of the error sits, and which measurement would tell more of it."""

    where: str
    next: str


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
    least = max(settings.plain, UnexplainedSettings.left * gained)
    if first is None or first.gain < least * point.fitted_error**2:
        return ""
    return str(first)


def rest_of(search: Search, best: Hypothesis, unsure: Collection[str]) -> Remainder:
    """What the best hypothesis leaves. `unsure`: effects in it that have rivals."""
    problem, theta = search.problem, search.points[best].fit.theta
    profiles = force_profiles(problem, problem.residual(theta))
    law = [hint.text for hint in lacking(profiles)]
    bins = sorted(conditions(problem, theta), key=lambda b: -b.ratio)
    worst = [f"{place_of(b)} ({short(b.ratio)} times the noise)" for b in bins if b.significant][:1]
    channel = profiles[0].channel if law else bins[0].channel if worst else ""
    advice = _advice(problem, channel)
    if unsure:
        named = " and ".join(unsure)
        advice = f"'kemba-opt experiment' proposes a test that tells {named} from what looks alike"
    return Remainder("; ".join([*worst, *law]) or "no condition in particular", advice)


def _advice(problem: Problem, channel: str) -> str:
    """What to measure to learn more about a channel, on the machine that the logs are of."""
    if not problem.moves:
        model = getattr(problem, "model", None)
        return STROKES if model is None else ON_RIGS.get(model.mechanism.rig, STROKES)
    parts = channel.replace(" ", "/").split("/")
    return next((text for key, text in NEXT.items() if key in parts), BODY)
