"""What robot logs can tell of: the catalogue's effects, put so that a switch can be linearised."""

from kemba.identify.problem.candidates import (
    CandidateSettings,
    by_default,
    effect_candidates,
    geometry_candidates,
    leg_candidates,
)
from kemba.identify.problem.structure import line_candidates, structure_candidates
from kemba.identify.problem.types import Candidate, Parameter
from kemba.model.model import Model

GROUND = ("ground_compliance", "ground_friction", "contact")
SHARED = ("supply_scale",)  # one supply feeds all legs
SOFTNESS = "ground_compliance.softness"
GRIP = "ground_friction.mu"
LAGS = ("hose_lag.T", "motor_lag.T")
NONE = 1e-6  # a lag that is none [s]: far below a row
ROBOT_CANDIDATE_SOFTNESS = 5e-5  # size of a ground's softness [m.N-1]
SOFTEST = 1e-3  # largest softness of a ground [m.N-1]


def robot_candidates(model: Model) -> dict[str, Candidate]:
    """The effects that `model` lacks, also on one leg only, and its lengths.

    A soft ground is searched by its softness 1/k.
    """
    found = effect_candidates(model)
    apart = leg_candidates(model, [n for n in found if n not in (*GROUND, *SHARED)])
    found = {**found, **apart, **geometry_candidates(model), **structure_candidates(model)}
    found |= line_candidates(model)
    if "ground_compliance" in found:
        found["ground_compliance"] = Candidate(
            "ground_compliance",
            Parameter("softness", "m.N-1", 0.0, ROBOT_CANDIDATE_SOFTNESS, 0.0, SOFTEST),
            (Parameter("d", "s.m-1", 1.0, 0.7, 0.1, 10.0, 1.0),),
            reciprocal={"softness": ("k", "N.m-1")},
        )
    return found


def in_the_air(found: dict[str, Candidate]) -> tuple[Candidate, ...]:
    """The candidates that stand in the model's equations; ground and sensors do not."""
    return tuple(c for c in found.values() if not c.sensor and c.effect not in GROUND)


def extended(model: Model, candidates: tuple[Candidate, ...]) -> Model:
    """The model without its ground, and with every candidate on its list, switched off."""
    kept = [e for e in model.effects if e.kind not in GROUND]
    bare = Model(model.mechanism, kept, model.supply, model.name)
    return bare.with_effects(by_default(c.effect) for c in candidates)


def ground_of(model: Model) -> tuple[float, dict[str, float]]:
    """Friction coefficient of the model's ground, and its softness where it is not rigid."""
    mu, soft = 1.0, {}
    for effect in model.effects:
        if effect.kind in GROUND:
            mu *= float(effect.mu)  # type: ignore[attr-defined]
        if effect.kind == "ground_compliance":
            soft = {SOFTNESS: 1.0 / effect.k, "ground_compliance.d": effect.d}  # type: ignore[attr-defined]
    return mu, soft


def without_delay(name: str, value: float) -> float:
    """A lag too short to matter as the model should have it: none."""
    short = name in LAGS and value < CandidateSettings.fastest
    return NONE if short else value
