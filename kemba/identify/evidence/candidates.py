"""What may be missing: effects of the catalogue that a model could have, and sensor faults."""

from __future__ import annotations

from collections.abc import Mapping

from kemba.effects import BY_KIND
from kemba.effects.base import Effect
from kemba.identify.evidence.problem import Candidate, Parameter
from kemba.model.model import Model
from kemba.model.scene import port_name

FASTEST = 6e-4  # s
REACH = 10.0  # a shape parameter is looked for within this factor of its typical value


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
    fields, declared = effect.model_fields, effect.declared()
    (lead, off), *_ = effect.off.items()
    param = declared[lead]
    # a time constant far below the sampling interval is no different from none
    lower = max(param.lower, FASTEST) if param.unit == "s" and param.lower > 0 else param.lower
    switch = Parameter(lead, param.unit, off, param.size, lower, param.upper)
    shapes = []
    for name in (n for n in declared if n != lead):
        p, typical = declared[name], float(fields[name].default)
        bounds = (max(p.lower, typical / REACH), min(p.upper, typical * REACH))
        shapes.append(Parameter(name, p.unit, typical, 0.7, *bounds, typical))
    return Candidate(fields["kind"].default, switch, tuple(shapes))


def sensor_candidates(sigmas: Mapping[str, float]) -> dict[str, Candidate]:
    """Bias, scale and delay of each channel; `sigmas` is the noise per sample."""
    found = {}
    for channel, sigma in sigmas.items():
        for kind, lead in (
            ("sensor_bias", Parameter("b", _unit(channel), 0.0, 5.0 * sigma)),
            ("sensor_scale", Parameter("k", "1", 0.0, 0.02)),
            ("sensor_delay", Parameter("dt", "s", 0.0, 0.003)),
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
