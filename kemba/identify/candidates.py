"""What may be missing: effects of the catalogue that a model could have, and sensor faults."""

from __future__ import annotations

from collections.abc import Mapping

from kemba.effects import BY_KIND
from kemba.effects.base import Effect
from kemba.identify.problem import Candidate, Parameter
from kemba.model.model import Model
from kemba.model.scene import port_name

# The planning model's own parts: they are there, and their figures are nuisance.
STRUCTURE = {"valve", "chamber", "mode_damping", "motor", "end_stop", "contact", "boom"}


def effect_candidates(model: Model) -> dict[str, Candidate]:
    """Every effect of the catalogue whose ports this model has and whose list lacks it."""
    present = {e.kind for e in model.effects}
    found = {}
    for kind, effect in BY_KIND.items():
        if kind in STRUCTURE | present or not _is_switch(effect) or not _fits(model, effect):
            continue
        found[kind] = candidate(effect)
    return found


def candidate(effect: type[Effect]) -> Candidate:
    """Its first parameter switches it; the others are shapes."""
    lead, *shapes = effect.parameters()
    fields = effect.model_fields
    param = effect.parameters()[lead]
    off = float(fields[lead].default)
    switch = Parameter(lead, param.unit, off, param.size, param.lower, param.upper)
    others = []
    for name in shapes:
        p, typical = effect.parameters()[name], float(fields[name].default)
        bounds = (max(p.lower, typical / 10.0), min(p.upper, typical * 10.0))
        others.append(Parameter(name, p.unit, typical, 0.5, *bounds, typical))
    return Candidate(fields["kind"].default, switch, tuple(others))


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


def _is_switch(effect: type[Effect]) -> bool:
    """Whether its parameters' defaults make it do nothing, so that theta can switch it on."""
    fields, names = effect.model_fields, list(effect.parameters())
    return bool(names) and all(isinstance(fields[n].default, float) for n in names)


def _fits(model: Model, effect: type[Effect]) -> bool:
    legs = (None,) if effect.place == "body" else model.mechanism.legs
    ports = {port_name(leg, alias) for leg in legs for alias in effect.ports}
    return ports <= set(model.mechanism.ports)
