"""What may be missing: effects of the catalogue that a model could have, and sensor faults."""

from __future__ import annotations

from collections.abc import Mapping

from kemba.effects import BY_KIND
from kemba.effects.base import Effect
from kemba.identify.evidence.problem import Candidate, Parameter
from kemba.model.model import Model
from kemba.model.scene import port_name
from kemba.settings import BY_HAND, Settings, setting


class CandidateSettings(Settings):
    """Where the parameters of a missing effect are looked for."""

    fastest: float = setting(
        6e-4,
        "s",
        "smallest time constant that is looked for",
        "derived: about half a sampling interval of 1 ms; a shorter one shows in no log",
    )
    reach: float = setting(
        10.0, "1", "a shape parameter is looked for within this factor of its default", BY_HAND
    )
    shape: float = setting(
        0.7, "1", "prior width of the logarithm of a shape parameter", "convention: a factor of two"
    )
    bias: float = setting(5.0, "1", "size of a sensor's bias, in sigmas of its noise", BY_HAND)
    scale: float = setting(0.02, "1", "size of a sensor's scale error", BY_HAND)
    delay: float = setting(0.003, "s", "size of a sensor's delay", BY_HAND)


def effect_candidates(model: Model) -> dict[str, Candidate]:
    """Every effect of the catalogue whose ports this model has and whose list lacks it."""
    present = {e.kind for e in model.effects}
    found = {}
    for kind, effect in BY_KIND.items():
        sensor = effect.family == "sensors"
        if effect.off and not sensor and kind not in present and _fits(model, effect):
            found[kind] = candidate(effect)
    return found


def by_default(kind: str) -> Effect:
    """The effect of a kind as its defaults have it: absent."""
    return BY_KIND[kind](kind=kind)


def candidate(effect: type[Effect]) -> Candidate:
    """What `effect` declares: the parameter in `off` switches it, the others are shapes."""
    settings = CandidateSettings.current()
    fields, declared = effect.model_fields, effect.declared()
    (lead, off), *_ = effect.off.items()
    param = declared[lead]
    # a time constant far below the sampling interval is the same as none
    lower = (
        max(param.lower, settings.fastest) if param.unit == "s" and param.lower > 0 else param.lower
    )
    switch = Parameter(lead, param.unit, off, param.size, lower, param.upper)
    shapes = []
    for name in (n for n in declared if n != lead):
        p, typical = declared[name], float(fields[name].default)
        bounds = (max(p.lower, typical / settings.reach), min(p.upper, typical * settings.reach))
        shapes.append(Parameter(name, p.unit, typical, settings.shape, *bounds, typical))
    return Candidate(fields["kind"].default, switch, tuple(shapes))


def sensor_candidates(sigmas: Mapping[str, float]) -> dict[str, Candidate]:
    """Bias, scale and delay of each channel; `sigmas` is the noise per sample."""
    found, sizes = {}, CandidateSettings.current()
    for channel, sigma in sigmas.items():
        for kind, lead in (
            ("sensor_bias", Parameter("b", _unit(channel), 0.0, sizes.bias * sigma)),
            ("sensor_scale", Parameter("k", "1", 0.0, sizes.scale)),
            ("sensor_delay", Parameter("dt", "s", 0.0, sizes.delay)),
        ):
            name = f"{kind}:{channel}"
            found[name] = Candidate(name, lead, sensor=True)
    return found


def _unit(channel: str) -> str:
    last = channel.rsplit("/", 1)[-1]
    return {"F": "N", "x": "m", "z": "m", "q": "rad", "pitch": "rad", "P": "Pa"}.get(last, "1")


def _fits(model: Model, effect: type[Effect]) -> bool:
    legs = (None,) if effect.place == "body" else model.mechanism.legs
    ports = {port_name(leg, alias) for leg in legs for alias in effect.ports}
    return ports <= set(model.mechanism.ports)
