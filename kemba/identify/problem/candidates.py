"""What may be missing: effects of the catalogue that a model could have, and sensor faults."""

from collections.abc import Callable, Iterable, Mapping
from typing import Generic, TypeVar

from kemba.effects import BY_KIND
from kemba.effects.base import Effect
from kemba.effects.mechanics.geometry import SIZES, Geometry
from kemba.identify.problem.sensor_faults import possible_faults
from kemba.identify.problem.structure import LINE, ORIFICE, LineResistance, OrificeShare
from kemba.identify.problem.types import Candidate, Parameter, Theta
from kemba.model.evaluation import port_name
from kemba.model.model import Model
from kemba.quantity import Param

LINK = "tolerance."  # how names of a link's figures begin


def nominal_figures(model: Model, except_for: Iterable[str] = ()) -> dict[str, tuple[float, float]]:
    """Factor 1 and its 1 sigma by figure, named as `Model.build(scaled=...)` takes them.

    `except_for`: parameters that are free anyway; the figures of their effects are left out.
    """
    free = {name.rsplit(".", 1)[0] for name in except_for}
    return {
        f"{effect.name}.{figure}": (1.0, share)
        for effect in model.effects
        if effect.name not in free
        for figure, share in effect.tolerances().items()
    }


def link_figures(model: Model) -> dict[str, tuple[float, float]]:
    """Share 0 by which a link's figure is off, and its 1 sigma, by name; {} for a rig."""
    found = model.mechanism.tolerances
    return {f"{LINK}{name}": (0.0, share) for name, share in found.items()}


def leg_by_leg(model: Model) -> Model:
    """The same model with every effect that has nominal figures of its own once per leg: the parts
    of one leg differ from those of another."""
    effects: list[Effect] = []
    for effect in model.effects:
        if effect.nominal and effect.place == "leg" and effect.leg is None:
            effects += [effect.bind({"on": leg}) for leg in model.mechanism.legs]
        else:
            effects.append(effect)
    return Model(model.mechanism, effects, model.supply, model.name)


T = TypeVar("T")
SEARCHED: dict[str, Effect] = {ORIFICE: OrificeShare(), LINE: LineResistance()}


class CandidateSettings:
    """Where the parameters of a missing effect are looked for."""

    # smallest time constant that is looked for [s]: about half a sampling interval of 1 ms; a
    # shorter one shows in no log
    fastest = 6e-4
    reach = 10.0  # a shape parameter is looked for within this factor of its default
    shape = 0.7  # prior width of the logarithm of a shape parameter: a factor of two


def effect_candidates(model: Model) -> dict[str, Candidate]:
    """Every effect of the catalogue whose ports this model has and whose list lacks it; those that
    need more than their kind, such as a sensor's channel, are not among them."""
    present = {e.kind for e in model.effects}
    found = {}
    for kind, effect in BY_KIND.items():
        missing = effect.off and kind not in present
        if effect.own_rigs and not model.mechanism.rig:
            continue
        whole = not any(field.is_required() for field in effect.model_fields.values())
        if missing and whole and _fits(model, effect):
            found[kind] = _candidate(kind, effect, effect.declared())
    return found


def by_default(name: str) -> Effect:
    """The effect of a name as its defaults have it: absent."""
    if name in SEARCHED:
        return SEARCHED[name]
    kind, _, place = name.partition(":")
    where = {where_field(kind): place} if place else {}
    return BY_KIND[kind].model_validate({"kind": kind, **where})


class CompiledModels(Generic[T]):
    """A model compiled with the effects that theta switches on, each set of effects once.

    `figures`: nominal numbers of the model that theta may scale, with factor and 1 sigma, by name.
    `build` takes a model and the numbers that are left open: free parameters, scaled figures.
    """

    def __init__(
        self,
        model: Model,
        candidates: Mapping[str, Candidate],
        figures: dict[str, tuple[float, float]],
        build: Callable[[Model, tuple[str, ...], tuple[str, ...]], T],
    ) -> None:
        self.model, self.candidates, self.figures = model, candidates, figures
        self._build, self._known = build, dict[tuple[str, ...], T]()

    def at(self, theta: Theta) -> T:
        """The model with the effects on its list that theta switches on."""
        active = tuple(
            name
            for name, c in sorted(self.candidates.items())
            if not c.sensor and theta.get(c.key, c.lead.off) != c.lead.off
        )
        if active not in self._known:
            present = {e.name for e in self.model.effects}
            extra = (e for e in map(by_default, active) if e.name not in present)
            model = self.model.with_effects(extra)
            keys = (key for name in active for key in tuple(self.candidates[name].keys()))
            free = tuple(key for key in keys if key in model.parameters)
            self._known[active] = self._build(model, free, tuple(self.figures))
        return self._known[active]

    def values(self, theta: Theta, names: Iterable[str]) -> dict[str, float]:
        """What these open numbers are at theta."""
        nominal = {name: factor for name, (factor, _) in self.figures.items()}
        return {name: theta.get(name, nominal.get(name, 0.0)) for name in names}


def where_field(kind: str) -> str:
    """The field that says where an effect acts, the second part of its name: a sensor's `channel`,
    the `part` of a length, else the leg that it is `on`."""
    fields = BY_KIND[kind].model_fields
    return next((name for name, field in fields.items() if field.is_required()), "on")


def leg_candidates(model: Model, kinds: Iterable[str]) -> dict[str, Candidate]:
    """Each of these kinds of effects on one leg only, as `seal_friction:front`, beside one value
    for all legs.

    Effects with a state of their own are left out: a leg cannot have the same state twice.
    """
    legs = model.mechanism.legs
    own = [k for k in kinds if BY_KIND[k].place == "leg" and not by_default(k).states()]
    names = {f"{kind}:{leg}": BY_KIND[kind] for kind in own for leg in legs if len(legs) > 1}
    return {name: _candidate(name, effect, effect.declared()) for name, effect in names.items()}


def geometry_candidates(model: Model) -> dict[str, Candidate]:
    """Every length of the robot that the model's list does not correct."""
    present = {e.name for e in model.effects}
    parts = [Geometry(part=part) for part in SIZES] if model.mechanism.robot else []
    return {
        e.name: _candidate(e.name, Geometry, e.parameters()) for e in parts if e.name not in present
    }


def sensor_candidates(sigmas: Mapping[str, float], model: Model) -> dict[str, Candidate]:
    """Every sensor fault that the model's list lacks; `sigmas`: noise per sample by channel."""
    present = {e.name for e in model.effects}
    found = {}
    for channel, sigma in sigmas.items():
        for name, fault in possible_faults(channel).items():
            if name not in present:
                found[name] = _candidate(name, type(fault), fault.sized(sigma), sensor=True)
    return found


def _candidate(
    name: str, effect: type[Effect], declared: Mapping[str, Param], sensor: bool = False
) -> Candidate:
    """What an effect declares: the parameter in `off` switches it, the others are shapes."""
    settings = CandidateSettings
    (lead, off), *_ = effect.off.items()
    param = declared[lead]
    # a time constant far below the sampling interval is the same as none
    lower = (
        max(param.lower, settings.fastest) if param.unit == "s" and param.lower > 0 else param.lower
    )
    switch = Parameter(lead, param.unit, off, param.size, lower, param.upper)
    shapes = []
    for other in (n for n in declared if n != lead):
        p, typical = declared[other], float(effect.model_fields[other].default)
        bounds = (max(p.lower, typical / settings.reach), min(p.upper, typical * settings.reach))
        shapes.append(Parameter(other, p.unit, typical, settings.shape, *bounds, typical))
    return Candidate(name, switch, tuple(shapes), sensor)


def _fits(model: Model, effect: type[Effect]) -> bool:
    legs = (None,) if effect.place == "body" else model.mechanism.legs
    ports = {port_name(leg, alias) for leg in legs for alias in effect.ports}
    given = {symbol for e in model.effects for symbol in e.publishes}
    return ports <= set(model.mechanism.ports) and given >= set(effect.needs)
