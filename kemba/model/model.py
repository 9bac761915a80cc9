"""Model: a mechanism and a list of effects, resolved into one labelled residual."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import casadi as ca

from kemba.effects.base import Effect
from kemba.errors import KembaError, suggest
from kemba.mechanism import Mechanism, reshaped
from kemba.model.evaluation import Evaluation, Instance, Key, full_name, place_effects, port_name
from kemba.quantity import Param, Quantity


@dataclass(frozen=True)
class Row:
    """Where a residual row comes from: `label` is `leg/effect:equation`."""

    label: str
    unit: str
    scale: float = 1.0


@dataclass(frozen=True)
class Node:
    """0 = F(yd, y, lam, u, p), 0 <= a _|_ b >= 0 as SX expressions.

    Symbols: q, v, a (n,), s and sd (effect states and their rates), lam (forces), u (inputs),
    p (free parameters). Expressions: `dynamics` (n,) [N or N.m], `rate` = sd - f (ns,),
    `pair_a`, `pair_b` (np,), `limits` >= 0, `outputs` by column name.
    """

    q: ca.SX
    v: ca.SX
    a: ca.SX
    s: ca.SX
    sd: ca.SX
    lam: ca.SX
    u: ca.SX
    p: ca.SX
    dynamics: ca.SX
    rate: ca.SX
    pair_a: ca.SX
    pair_b: ca.SX
    limits: ca.SX
    outputs: dict[str, ca.SX]
    output_quantities: tuple[Quantity, ...]
    dynamics_rows: tuple[Row, ...]
    rate_rows: tuple[Row, ...]
    pair_rows: tuple[tuple[Row, Row], ...]
    limit_rows: tuple[Row, ...]

    @property
    def symbols(self) -> list[ca.SX]:
        """Symbols q, v, a, s, sd, lam, u, p, each a column vector, in the order in which every
        function built from this node takes them."""
        return [self.q, self.v, self.a, self.s, self.sd, self.lam, self.u, self.p]

    NAMES = ("q", "v", "a", "s", "sd", "lam", "u", "p")

    @cached_property
    def residual(self) -> ca.Function:
        """(q, v, a, s, sd, lam, u, p) -> (dynamics, rate, pair_a, pair_b, limits)."""
        results = ["dynamics", "rate", "pair_a", "pair_b", "limits"]
        return ca.Function(
            "residual", self.symbols, [getattr(self, r) for r in results], list(self.NAMES), results
        )

    @cached_property
    def measure(self) -> ca.Function:
        """(q, v, a, s, sd, lam, u, p) -> every output, in the order of `output_quantities`."""
        columns = ca.vertcat(*(self.outputs[o.name] for o in self.output_quantities))
        return ca.Function("measure", self.symbols, [columns], list(self.NAMES), ["y"])


NOMINAL_SUPPLY = 0.7e6  # Pa, of a model that names none
SUPPLY = "supply"  # its name beside those of parameters


class Model:
    """A mechanism with effects; the order of the list does not matter.

    `supply` is the air pressure [Pa] at which the tables of the effects are read; `remarks` say
    where that is outside of what was measured. Figures that an effect does not give come from the
    cylinder.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        effects: Iterable[Effect],
        supply: float = NOMINAL_SUPPLY,
        name: str = "model",
    ) -> None:
        cylinder = mechanism.cylinder
        self.effects = tuple(e.of_cylinder(cylinder) if cylinder else e for e in effects)
        self.mechanism = reshaped(mechanism, lengths(self.effects))
        mechanism = self.mechanism
        self.supply, self.name = supply, name
        self.remarks = [text for e in self.effects for text in e.remarks(supply)]
        self.instances = place_effects(mechanism, self.effects)
        self.states = self._variables("states")
        self.inputs = self._variables("inputs")
        self.forces = self._variables("forces")

    def __repr__(self) -> str:
        count = len(self.effects)
        of = f"{count} effect{'s' * (count != 1)}, air of {self.supply / 1e6:.3g} MPa"
        return f"Model({self.name}: {of})"

    def _variables(self, role: str) -> dict[Key, Quantity]:
        found: dict[Key, Quantity] = {}
        for instance in self.instances:
            for key, quantity in instance.variables(role).items():
                if key in found:
                    raise KembaError(
                        f"effects.{instance.effect.name}", f"'{quantity.name}' is declared twice"
                    )
                found[key] = quantity
        return found

    def with_effects(self, effects: Iterable[Effect]) -> Model:
        """The same model with `effects` added; one of the same name is replaced."""
        new = {e.name: e for e in (*self.effects, *effects)}
        return Model(self.mechanism, new.values(), self.supply, self.name)

    def effect(self, name: str) -> Effect:
        """The effect called `name`. Raises KembaError."""
        for effect in self.effects:
            if effect.name == name:
                return effect
        names = [e.name for e in self.effects]
        raise KembaError(self.name, f"no effect '{name}'", hint=suggest(name, names))

    @property
    def state(self) -> list[Quantity]:
        """What the state x = (q, v, s) consists of: coordinates, velocities, effect states."""
        return [quantity for group in ("q", "v", "s") for quantity in self.groups[group]]

    @cached_property
    def groups(self) -> dict[str, tuple[Quantity, ...]]:
        """The quantities of the node's symbols q, v, s, u and lam."""
        return {
            "q": self.mechanism.coordinates,
            "v": self.mechanism.velocities,
            "s": tuple(self.states.values()),
            "u": tuple(self.inputs.values()),
            "lam": tuple(self.forces.values()),
        }

    @property
    def ignored(self) -> list[str]:
        """Effects that are part of measuring, not of the motion, such as a sensor's bias."""
        return [e.name for e in self.effects if not e.moves]

    def timing(
        self, leg: str | None, values: Mapping[str, float] | None = None
    ) -> tuple[float, float]:
        """Seconds by which a leg's valves switch on and off after the command.

        `values`: parameters that differ from the model's, by their names in `parameters`.
        """
        late = [i for i in self.instances if type(i.effect).timing is not Effect.timing]
        effects = [i.effect for i in late if i.leg in (leg, None)]
        here = [_with(effect, values or {}).timing() for effect in effects]
        on = sum(t.get("on", 0.0) for t in here)
        return on, sum(t.get("off", 0.0) for t in here)

    @cached_property
    def delays(self) -> tuple[str, ...]:
        """Parameters (names as in `parameters`) that say when valves switch."""
        late = [effect for effect in self.effects if effect.timing()]
        return tuple(f"{effect.name}.{field}" for effect in late for field in effect.parameters())

    @cached_property
    def parameters(self) -> dict[str, tuple[Param, float]]:
        """Every scalar parameter as `effect.field`: its unit and size, and its value."""
        return {
            f"{effect.name}.{field}": (param, effect.value(field))
            for effect in self.effects
            for field, param in effect.parameters().items()
        }

    @cached_property
    def node(self) -> Node:
        """The residual with every parameter at its value."""
        return self.build()

    def build(self, free: Iterable[str] = (), scaled: Iterable[str] = ()) -> Node:
        """The residual with the parameters `free` (names as in `parameters`) left as symbols.

        Every number named in `scaled` is multiplied by a symbol; it may be a whole table
        (`chamber.F_extend`) or one entry of it (`chamber.fill[0]`). In the parameters p these
        factors follow the free parameters. Where effects stand once per leg, the name of their kind
        stands for all of them; `supply` in `free` is the pressure [Pa] at which tables are read.
        Raises KembaError where the model has no such parameter.
        """
        free, scaled = list(free), list(scaled)
        own = [name for name in free if name != SUPPLY]
        for name in own:
            if any(f"{e}.{_field(name)}" not in self.parameters for e in self._meant(name)):
                hint = suggest(name, self.parameters)
                raise KembaError(self.name, f"no parameter '{name}'", hint=hint)
        p = ca.SX.sym("p", len(free) + len(scaled))
        bound: dict[str, dict[str, Any]] = {}
        for name in own:
            for effect in self._meant(name):
                bound.setdefault(effect, {})[_field(name)] = p[free.index(name)]
        for i, name in enumerate(scaled, start=len(free)):
            for effect in self._meant(name):
                _scale(self, bound, f"{effect}.{_field(name)}", p[i])
        instances = [
            Instance(i.effect.bind(bound.get(i.effect.name, {})), i.leg) for i in self.instances
        ]
        free_lengths = lengths(i.effect for i in instances if i.effect.name in bound)
        mechanism = reshaped(self.mechanism, self.mechanism.offsets, free_lengths)
        supply = p[free.index(SUPPLY)] if SUPPLY in free else self.supply
        return _assemble(self, mechanism, instances, p, supply)

    def _meant(self, name: str) -> list[str]:
        """Names of the effects that `effect.field` is about: that effect, or all of that kind."""
        effect = name.rsplit(".", 1)[0]
        kind = [e.name for e in self.effects if e.kind == effect]
        return [effect] if effect in [e.name for e in self.effects] or not kind else kind


def _field(name: str) -> str:
    """The field of `effect.field`."""
    return name.rsplit(".", 1)[1]


def lengths(effects: Iterable[Effect]) -> dict[str, Any]:
    """Lengths [m] by which the effects of a model change its mechanism, by part."""
    return {part: d for effect in effects for part, d in effect.geometry.items()}


def _with(effect: Effect, values: Mapping[str, float]) -> Effect:
    """The effect with those of `values` that are its own (`effect.field`)."""
    own = {f: values[f"{effect.name}.{f}"] for f in effect.declared()
           if f"{effect.name}.{f}" in values}  # fmt: skip
    return effect.bind(own) if own else effect


def _scale(model: Model, bound: dict[str, dict[str, Any]], name: str, factor: ca.SX) -> None:
    """Multiply the number, table or table entry `name` by `factor` in `bound`."""
    effect, field = name.rsplit(".", 1)
    field, _, entry = field.partition("[")
    values = bound.setdefault(effect, {})
    value = values.get(field, getattr(model.effect(effect), field))
    if not isinstance(value, tuple):
        values[field] = value * factor
    else:
        chosen = {int(entry.rstrip("]"))} if entry else set(range(len(value)))
        values[field] = tuple(v * factor if i in chosen else v for i, v in enumerate(value))


def _symbols(prefix: str, quantities: Mapping[Key, Quantity]) -> tuple[ca.SX, dict[Key, ca.SX]]:
    vector = ca.vertcat(*(ca.SX.sym(f"{prefix}:{q.name}") for q in quantities.values()))
    vector = ca.SX(vector) if quantities else ca.SX.zeros(0, 1)
    return vector, {key: vector[i] for i, key in enumerate(quantities)}


def _assemble(
    model: Model, mechanism: Mechanism, instances: list[Instance], p: ca.SX, supply: Any
) -> Node:
    s, states = _symbols("s", model.states)
    lam, forces = _symbols("lam", model.forces)
    u, inputs = _symbols("u", model.inputs)
    sd = ca.SX.sym("sd", s.numel())
    values = {**states, **forces, **inputs}
    evaluation = Evaluation(mechanism, instances, values, set(model.inputs), supply)
    parts = [(instance, evaluation.contribution(i)) for i, instance in enumerate(instances)]

    efforts: dict[str, Any] = {}
    rod = {leg: ca.SX(0) for leg in mechanism.legs}
    pairs, pair_rows, limits, limit_rows = [], [], [], []
    rates: dict[Key, Any] = {}
    own: list[tuple[Quantity, Any]] = []
    for instance, part in parts:
        for quantity, value in part.outputs:
            own.append((replace(quantity, name=full_name(instance.leg, quantity.name)), value))
        for alias, effort in part.effort.items():
            port = port_name(instance.leg, alias)
            efforts[port] = efforts.get(port, 0) + effort
            if alias == "piston" and instance.effect.on_rod:
                rod[instance.leg or ""] += effort
        for pair in part.pairs:
            label = f"{instance.label}:{pair.name}"
            pairs.append((pair.a, pair.b))
            pair_rows.append((Row(label, pair.unit_a), Row(label, pair.unit_b, mechanism.weight)))
        for name, limit in part.limits.items():
            limits.append(limit)
            limit_rows.append(Row(f"{instance.label}:{name}", "1"))
        for symbol, rate in part.rate.items():
            rates[(instance.leg, symbol)] = rates.get((instance.leg, symbol), 0) + rate
        for symbol, rate in part.add_rate.items():
            state, slope = evaluation.carrier(instance.leg, symbol)
            rates[(instance.leg, state)] = rates.get((instance.leg, state), 0) + rate / slope
    _check_rates(model, rates)

    return Node(
        q=mechanism.q,
        v=mechanism.v,
        a=mechanism.a,
        s=s,
        sd=sd,
        lam=lam,
        u=u,
        p=p,
        dynamics=mechanism.inverse_dynamics - mechanism.generalised(efforts),
        rate=ca.SX(sd - ca.vertcat(*(rates[key] for key in states))) if states else sd,
        pair_a=ca.SX(ca.vertcat(*(a for a, _ in pairs))),
        pair_b=ca.SX(ca.vertcat(*(b for _, b in pairs))),
        limits=ca.SX(ca.vertcat(*limits)),
        **_outputs(mechanism, rod, own),
        dynamics_rows=tuple(
            Row(f"dynamics:{c.name}", "N" if c.unit == "m" else "N.m", mechanism.weight)
            for c in mechanism.coordinates
        ),
        rate_rows=tuple(
            Row(f"rate:{quantity.name}", f"{quantity.unit}.s-1", quantity.scale)
            for quantity in model.states.values()
        ),
        pair_rows=tuple(pair_rows),
        limit_rows=tuple(limit_rows),
    )


def _check_rates(model: Model, rates: Mapping[Key, Any]) -> None:
    for key in model.states:
        if key not in rates:
            raise KembaError(full_name(*key), "has no rate: its effect declares but never moves it")
    for leg, symbol in rates:
        if (leg, symbol) not in model.states:
            raise KembaError(
                full_name(leg, symbol), "an effect changes its rate, but no effect declares it"
            )


def _outputs(
    mechanism: Mechanism, rod: Mapping[str, ca.SX], own: list[tuple[Quantity, Any]]
) -> dict[str, Any]:
    outputs: dict[str, ca.SX] = {quantity.name: value for quantity, value in own}
    quantities = [quantity for quantity, _ in own]
    for name, port in mechanism.ports.items():
        x, v, _ = mechanism.motion(name)
        outputs |= {name: x, port.rate.name: v}
        quantities += [port.quantity, port.rate]
    for axis in ("x", "z"):
        if f"body/{axis}" in mechanism.ports:
            outputs[f"body/a{axis}"] = mechanism.motion(f"body/{axis}")[2]
            quantities.append(Quantity(f"body/a{axis}", "m.s-2", doc="body centre acceleration"))
    for leg, force in rod.items():
        name = full_name(leg, "piston/F")
        if full_name(leg, "piston/x") not in mechanism.ports:
            continue
        outputs[name] = force
        quantities.append(Quantity(name, "N", doc="air and friction on the rod, pushing positive"))
    return {"outputs": outputs, "output_quantities": tuple(quantities)}
