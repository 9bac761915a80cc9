"""What may be missing: effects of the catalogue that a model could have, sensor faults, and what
needs more than its kind: another structure, and the line of the supply.

Orifice chambers in place of the first-order ones: the share `a` of the rod's force comes from them
and 1 - a from the chambers of the model, so that 0 is the model as it is and 1 the other structure.
An orifice of infinite area is as good as none, so the supply line is searched by the reciprocal of
its area, which is 0 where all of the tank's pressure reaches the valves.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Annotated, Any, ClassVar, Generic, Literal, TypeVar

import numpy as np

from kemba.effects import BY_KIND
from kemba.effects.base import At, Contribution, Effect
from kemba.effects.mechanics.geometry import SIZES, Geometry
from kemba.effects.pneumatics.orifice import OrificeChamber
from kemba.effects.pneumatics.supply import SupplyLine
from kemba.identify.problem.problem import Array, Candidate, Parameter, Theta
from kemba.identify.problem.sensor_faults import SensorFaults, possible_faults
from kemba.model.evaluation import port_name
from kemba.model.model import Model
from kemba.model.rest import StatesAlong
from kemba.quantity import Param, Quantity, Tolerance

ORIFICE = "chambers:orifice"
LEVEL = "level"
FIGURES = {  # as a model that has orifice chambers calls them: as the candidate does
    **{f"orifice_chamber.{k}": k for k in ("a_fill", "a_vent", "V_e", "V_r", "n")},
    "orifice_chamber.gauge": LEVEL,
}

# effects that those figures stand for, once they are free
FREE_THEN = ("supply_scale", "rise_time_scale")
OWN = {"P_e": "P_e_orifice", "P_r": "P_r_orifice"}  # states beside those of the model's chambers

# How far the figures of orifice chambers may be from the usual ones: 1 sigma of their logarithm.
AREA = 0.2  # of an orifice's area
VOLUME = 0.3  # of a dead volume
# of the pressure that reaches the valves: the size of `supply_scale`, which it stands for
STRUCTURE_LEVEL = 0.1
REACH = 4.0  # largest error of a figure, in these sigmas
EXPONENT = 0.08  # of the polytropic exponent
# 1 sigma of each figure's logarithm
WIDTHS = {"a_fill": AREA, "a_vent": AREA, "V_e": VOLUME, "V_r": VOLUME,
          LEVEL: STRUCTURE_LEVEL, "n": EXPONENT}  # fmt: skip


class OrificeShare(OrificeChamber):
    """A share of the rod's force that comes from orifice chambers instead of the model's own.

    `level` scales the pressure that reaches the valves.
    """

    kind: Literal["orifice_chamber"] = "orifice_chamber"
    a: Annotated[float, Param("1", 1.0, lower=0.0, upper=1.0, doc="share")] = 0.0
    level: Annotated[float, Param("1", 0.04, lower=0.0, doc="scale of the gauge pressure")] = 1.0

    off: ClassVar[dict[str, float]] = {"a": 0.0}
    publishes: ClassVar[tuple[str, ...]] = ()
    carried_by: ClassVar[dict[str, str]] = {}
    replaces: ClassVar[tuple[str, ...]] = ()
    nominal: ClassVar[dict[str, Tolerance]] = {}

    @property
    def name(self) -> str:
        return ORIFICE

    def states(self) -> dict[str, Quantity]:
        named = super().states()
        return {
            own: replace(named[symbol], name=f"{named[symbol].name}_orifice")
            for symbol, own in OWN.items()
        }

    def evaluate(self, at: At) -> Contribution:
        scaled = self.bind({"gauge": tuple(self.level * g for g in self.gauge)})
        other = OrificeChamber.evaluate(scaled, _OwnPressures(at))  # type: ignore[arg-type]
        own = at.F_e - at.F_r + at.F_mode
        return Contribution(
            effort={"piston": self.a * (other.effort["piston"] - own)},
            rate={OWN[symbol]: rate for symbol, rate in other.rate.items()},
        )


class _OwnPressures:
    """`At` in which the chambers' pressures are those of the share."""

    def __init__(self, at: At) -> None:
        self._at = at

    def __getattr__(self, symbol: str) -> Any:
        return getattr(self._at, OWN.get(symbol, symbol))


def structure_candidates(model: Model) -> dict[str, Candidate]:
    """Orifice chambers, where the model has first-order ones, with their figures free."""
    kinds = {effect.kind for effect in model.effects}
    if not {"chamber", "mode_damping"} <= kinds:
        return {}
    share = OrificeShare().of_cylinder(model.mechanism.need_cylinder())
    declared = share.declared()
    shapes = []
    for name, width in WIDTHS.items():
        param, usual = declared[name], float(share.value(name))
        reach = math.exp(REACH * width)
        low, high = max(param.lower, usual / reach), min(param.upper, usual * reach)
        shapes.append(Parameter(name, param.unit, usual, width, low, high, usual))
    lead = Parameter("a", "1", 0.0, 1.0, 0.0, 1.0)
    return {ORIFICE: Candidate(ORIFICE, lead, tuple(shapes))}


def with_orifices(model: Model, values: Mapping[str, float]) -> Model:
    """The model with orifice chambers in the place of its own, their figures those of `values`;
    the pressure at the valves is left as it is usual."""
    kept = [e for e in model.effects if e.kind not in OrificeChamber.replaces]
    figures = {k: values[k] for k in FIGURES.values() if k in values and k != LEVEL}
    return Model(model.mechanism, [*kept, OrificeChamber(**figures)], model.supply, model.name)


def free_figures(values: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """The figures of orifice chambers of all legs as nuisance parameters of a model that has them:
    value and 1 sigma by name; `gauge` is the scale of its table."""
    usual = {LEVEL: 1.0, **values}
    return {n: (usual[k], WIDTHS[k] * usual[k]) for n, k in FIGURES.items() if k in usual}


def orifice_item(values: Mapping[str, float]) -> dict[str, Any]:
    """The effect of a model's list with the figures found (by name, SI units)."""
    figures = {k: v for k, v in values.items() if k not in ("a", "level")}
    gauge = [float(f"{values.get('level', 1.0) * g:.6g}") for g in OrificeChamber().gauge]
    return {"kind": "orifice_chamber", **figures, "gauge": gauge}


LINE = "supply_line"

# Where the supply line's figures are looked for.
NO_ORIFICE = 1e3  # reciprocal of an orifice that is none [m-2]: 200 times a valve's area
SIZE = 1.5e5  # reciprocal that is neither small nor large [m-2]
LARGEST = 1e6  # largest reciprocal: an orifice of 1 mm2 [m-2]
LINE_VOLUME = 0.7  # prior width of the logarithm of the volume: a factor of two
LINE_REACH = 30.0  # a volume is looked for within this factor


class LineResistance(SupplyLine):
    """The supply line by the reciprocal `r` of its orifice."""

    kind: Literal["supply_line"] = "supply_line"
    r: Annotated[float, Param("m-2", 1.5e5, lower=0.0, doc="1/a, 0: no orifice")] = 0.0

    off: ClassVar[dict[str, float]] = {"r": 0.0}
    nominal: ClassVar[dict[str, Tolerance]] = {}

    def evaluate(self, at: At) -> Contribution:
        area = 1.0 / (self.r + NO_ORIFICE)
        return SupplyLine.evaluate(self.bind({"a": area}), at)  # type: ignore[arg-type]


def line_candidates(model: Model) -> dict[str, Candidate]:
    """The supply line, where the model's chambers publish their flow and it has no line yet."""
    drawing = any("draw_e" in effect.publishes for effect in model.effects)
    if not drawing or any(effect.kind == LINE for effect in model.effects):
        return {}
    volume = float(SupplyLine().V)
    lead = Parameter("r", "m-2", 0.0, SIZE, 0.0, LARGEST)
    ends = (volume / LINE_REACH, volume * LINE_REACH)
    hose = Parameter("V", "m3", volume, LINE_VOLUME, *ends, volume)
    return {LINE: Candidate(LINE, lead, (hose,), reciprocal={"r": ("a", "m2")})}


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


class OpenModel:
    """A model with some numbers left open: `free` parameters, `scaled` figures and tables."""

    def __init__(self, model: Model, free: tuple[str, ...], scaled: tuple[str, ...]) -> None:
        self.model, self.names = model, (*free, *scaled)
        self.node = model.build(free, scaled)
        self.along = StatesAlong.of(model, self.node)

    def parameters(self, values: Mapping[str, float]) -> Array:
        """The open numbers (k,) in their order; `values` holds every name of `names`."""
        return np.array([values[name] for name in self.names])


M = TypeVar("M", bound=OpenModel)


class CompiledModels(Generic[M]):
    """A model compiled with the effects that theta switches on, each set of effects once, and what
    its sensors make of it.

    `figures`: nominal numbers of the model that theta may scale, with factor and 1 sigma, by name.
    `build` takes a model and the numbers that are left open: free parameters, scaled figures.
    """

    def __init__(
        self,
        model: Model,
        candidates: Mapping[str, Candidate],
        build: Callable[[Model, tuple[str, ...], tuple[str, ...]], M],
    ) -> None:
        self.model, self.candidates = model, candidates
        self.figures, self.sensors = nominal_figures(model), SensorFaults(model.effects)
        self._build, self._known = build, dict[tuple[str, ...], M]()

    def at(self, theta: Theta) -> M:
        """The model with the effects on its list that theta switches on."""
        active = tuple(
            name for name, c in sorted(self.candidates.items()) if not c.sensor and c.is_on(theta)
        )
        if active not in self._known:
            present = {e.name for e in self.model.effects}
            extra = (e for e in map(by_default, active) if e.name not in present)
            model = self.model.with_effects(extra)
            keys = (key for name in active for key in tuple(self.candidates[name].keys()))
            free = tuple(key for key in keys if key in model.parameters)
            self._known[active] = self._build(model, free, tuple(self.figures))
        return self._known[active]

    def values(self, theta: Theta) -> dict[str, float]:
        """What the open numbers of this model are at theta."""
        nominal = {name: factor for name, (factor, _) in self.figures.items()}
        return {name: theta.get(name, nominal.get(name, 0.0)) for name in self.at(theta).names}


def where_field(kind: str) -> str:
    """The field that says where an effect acts, the second part of its name: a sensor's `channel`,
    the `part` of a length, else the leg that it is `on`."""
    fields = BY_KIND[kind].model_fields
    return next((name for name, field in fields.items() if field.is_required()), "on")


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

    One leg only, as `seal_friction:front`, beside one value for all legs: not of effects with a
    state of their own, which a leg cannot have twice. A soft ground is searched by its softness
    1/k.
    """
    found, legs, present = (
        effect_candidates(model),
        model.mechanism.legs,
        {e.name for e in model.effects},
    )
    for kind in [n for n in found if n not in (*GROUND, *SHARED)] if len(legs) > 1 else ():
        effect = BY_KIND[kind]
        if effect.place == "leg" and not by_default(kind).states():
            names = (f"{kind}:{leg}" for leg in legs)
            found |= {name: _candidate(name, effect, effect.declared()) for name in names}
    for part in SIZES if model.mechanism.robot else ():
        length = Geometry(part=part)
        if length.name not in present:
            found[length.name] = _candidate(length.name, Geometry, length.parameters())
    found |= structure_candidates(model) | line_candidates(model)
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
    lower = param.lower
    if param.unit == "s" and lower > 0:  # far below the sampling interval it is the same as none
        lower = max(lower, settings.fastest)
    switch = Parameter(lead, param.unit, off, param.size, lower, param.upper)
    shapes = []
    for other in (n for n in declared if n != lead):
        p, typical = declared[other], float(effect.model_fields[other].default)
        bounds = (max(p.lower, typical / settings.reach), min(p.upper, typical * settings.reach))
        shapes.append(Parameter(other, p.unit, typical, settings.shape, *bounds, typical))
    return Candidate(name, switch, tuple(shapes), sensor, effect.law_of)


def _fits(model: Model, effect: type[Effect]) -> bool:
    legs = (None,) if effect.place == "body" else model.mechanism.legs
    ports = {port_name(leg, alias) for leg in legs for alias in effect.ports}
    given = {symbol for e in model.effects for symbol in e.publishes}
    return ports <= set(model.mechanism.ports) and given >= set(effect.needs)
