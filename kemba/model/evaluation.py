"""Effects placed on a mechanism: names resolved, signals composed, each evaluated once."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import casadi as ca

from kemba.effects import BY_KIND
from kemba.effects.base import At, Contribution, Effect, PortAt, Signal
from kemba.effects.mechanics.laws import direction
from kemba.errors import KembaError, suggest
from kemba.mechanism import Bore, Mechanism
from kemba.quantity import Quantity

LEG_PORTS = {
    "piston": "piston/x",
    "hip": "hip/q",
    "foot_x": "foot/x",
    "foot_z": "foot/z",
    "axis": "axis/q",
}
BODY_PORTS = {"body_x": "body/x", "body_z": "body/z", "pitch": "body/pitch"}

Key = tuple[str | None, str]  # (leg, symbol); leg None: the whole robot


def full_name(leg: str | None, name: str) -> str:
    """Column name of a leg's or the robot's quantity."""
    return f"{leg}/{name}" if leg else name


class Instance:
    """One effect at one place."""

    def __init__(self, effect: Effect, leg: str | None) -> None:
        self.effect, self.leg = effect, leg

    @property
    def label(self) -> str:
        """Name of the instance: `hip_friction`, or `front/hip_friction` at a leg."""
        return full_name(self.leg, self.effect.name)

    def variables(self, role: str) -> dict[Key, Quantity]:
        """Its `states`, `inputs` or `forces`, under their full column names."""
        own = getattr(self.effect, role)()
        return {(self.leg, s): replace(q, name=full_name(self.leg, q.name)) for s, q in own.items()}


def place_effects(mechanism: Mechanism, effects: Iterable[Effect]) -> list[Instance]:
    """Every effect at every place where it acts, in canonical order. Raises KembaError."""
    listed = sorted(effects, key=lambda e: e.name)
    names = [e.name for e in listed]
    for name in names:
        if names.count(name) > 1:
            raise KembaError(f"effects.{name}", "listed twice", "each effect once per leg")
    gone = {(kind, e.leg) for e in listed for kind in e.replaces}
    instances = []
    for effect in listed:
        legs: Iterable[str | None] = (None,) if effect.place == "body" else mechanism.legs
        if effect.leg is not None:
            if effect.leg not in mechanism.legs:
                what = f"{mechanism.name} has no leg '{effect.leg}'"
                hint = suggest(effect.leg, filter(None, mechanism.legs))
                raise KembaError(f"effects.{effect.name}", what, hint=hint)
            legs = (effect.leg,)
        for leg in legs:
            if gone & {(effect.kind, None), (effect.kind, leg)}:
                continue
            _check_ports(mechanism, effect, leg)
            instances.append(Instance(effect, leg))
    return instances


def _check_ports(mechanism: Mechanism, effect: Effect, leg: str | None) -> None:
    for alias in effect.ports:
        name = port_name(leg, alias)
        if name not in mechanism.ports:
            what = f"needs the port '{name}', which {mechanism.name} does not have"
            hint = f"ports: {', '.join(mechanism.ports)}"
            raise KembaError(f"effects.{effect.name}", what, hint=hint)


def port_name(leg: str | None, alias: str) -> str:
    """Full port name of an alias such as `piston` at a leg."""
    return BODY_PORTS[alias] if alias in BODY_PORTS else full_name(leg, LEG_PORTS[alias])


def _providers(symbol: str) -> str:
    """Which effects of the catalogue would provide a symbol, in words."""
    found = []
    for kind, effect in BY_KIND.items():
        variables: set[str] = set()
        if not any(field.is_required() for field in effect.model_fields.values()):
            example = effect.model_validate({})
            variables = {*example.states(), *example.inputs(), *example.forces()}
        if symbol in effect.publishes or symbol in variables:
            found.append(kind)
    return f"add {' or '.join(found)}" if found else ""


class Evaluation:
    """All instances with the symbols of one evaluation.

    `values` holds the SX of every state, input and force by (leg, symbol). Published values and
    signals are resolved on demand, so the order of the effects cannot matter.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        instances: list[Instance],
        values: Mapping[Key, ca.SX],
        inputs: set[Key],
        supply: Any,
    ) -> None:
        self.mechanism, self.instances, self.supply = mechanism, instances, supply
        self.values, self.inputs = values, inputs
        self.slots = {slot for i in instances for slot in i.effect.reads}
        self._contributions: dict[int, Contribution] = {}
        self._busy: dict[int, None] = {}  # in the order in which they ask for one another
        self._signals = self._collect_signals()

    def at(self, leg: str | None) -> At:
        """The view of effects at `leg` (None: the robot)."""
        return _Place(self, leg)

    def contribution(self, index: int) -> Contribution:
        """What instance `index` adds; evaluated once. Raises KembaError where the effect reads a
        value that depends on itself."""
        if index not in self._contributions:
            if index in self._busy:
                raise KembaError(self.instances[index].label, "reads a value that depends on it")
            self._busy[index] = None
            instance = self.instances[index]
            self._contributions[index] = instance.effect.evaluate(self.at(instance.leg))
            del self._busy[index]
        return self._contributions[index]

    def lookup(self, leg: str | None, symbol: str) -> Any:
        """Value of a symbol as seen from `leg`: a signal, a variable, or a published value. Raises
        KembaError where nothing gives it."""
        if symbol in self.slots or (leg, symbol) in self.inputs:
            return self.signal(leg, symbol)
        for place in (leg, None):
            if (place, symbol) in self.values:
                return self.values[(place, symbol)]
            for index, instance in enumerate(self.instances):
                if instance.leg == place and symbol in instance.effect.publishes:
                    return self.contribution(index).publish[symbol]
        known = {s for _, s in self.values} | self.slots
        asking = [self.instances[i].label for i in self._busy]
        place = leg or self.mechanism.name
        raise KembaError(
            f"effects.{asking[-1]}" if asking else full_name(leg, symbol),
            f"needs '{symbol}' at {place}, which no effect of this model gives",
            hint=_providers(symbol) or suggest(symbol, known),
        )

    def carrier(self, leg: str | None, symbol: str) -> tuple[str, Any]:
        """The state through which a published value is moved, and d value / d state."""
        for instance in self.instances:
            if instance.leg == leg and symbol in instance.effect.carried_by:
                state = instance.effect.carried_by[symbol]
                value = self.lookup(leg, symbol)
                return state, ca.jacobian(value, self.values[(leg, state)])
        return symbol, 1.0

    def signal(self, leg: str | None, name: str, lag: bool = True) -> Any:
        """A signal: its input (or 1) times every gain, or the lagged value in its place."""
        value: Any = self.values[(leg, name)] if (leg, name) in self.inputs else 1.0
        for place in dict.fromkeys((leg, None)):
            for signal in self._signals.get((place, name), ()):
                if signal.lagged is not None:
                    if lag:
                        return signal.lagged
                else:
                    value = value * signal.gain
        return value

    def _collect_signals(self) -> dict[Key, list[Signal]]:
        found: dict[Key, list[Signal]] = {}
        heard = self.slots | {symbol for _, symbol in self.inputs}
        for instance in self.instances:
            for name, signal in instance.effect.signals(self.at(instance.leg)).items():
                if name not in heard:
                    what = f"changes the signal '{name}', which no effect of this model reads"
                    hint = "add the effect it acts on, or remove it"
                    raise KembaError(f"effects.{instance.effect.name}", what, hint=hint)
                found.setdefault((instance.leg, name), []).append(signal)
        for (leg, name), signals in found.items():
            if sum(s.lagged is not None for s in signals) > 1:
                raise KembaError(full_name(leg, name), "two effects lag the same signal")
            # a lag answers last, whatever the order of the list
            signals.sort(key=lambda s: s.lagged is None)
        return found


class _Place:
    """`At` for one leg of an evaluation."""

    def __init__(self, evaluation: Evaluation, leg: str | None) -> None:
        self._evaluation, self._leg = evaluation, leg
        self.supply = evaluation.supply
        self.ground = evaluation.mechanism.scene.ground
        self.gravity = evaluation.mechanism.gravity
        self.body_mass = evaluation.mechanism.body_mass
        self.sign_speed = evaluation.mechanism.sign_speed

    @property
    def cylinder(self) -> Bore:
        """Dimensions of every leg's cylinder. Raises KembaError where there are no pistons."""
        return self._evaluation.mechanism.need_bore()

    @property
    def stroke(self) -> float:
        """Stroke of every piston [m]. Raises KembaError for a mechanism without pistons."""
        return self._evaluation.mechanism.stroke

    @property
    def sense(self) -> Any:
        """Direction in which the piston's seals slide: what an effect publishes, else the sign of
        its rate."""
        for instance in self._evaluation.instances:
            if instance.leg == self._leg and "sense" in instance.effect.publishes:
                return self._evaluation.lookup(self._leg, "sense")
        return direction(self.piston.v, self.sign_speed)

    @property
    def legs(self) -> list[At]:
        """The same view at each leg."""
        return [self._evaluation.at(leg) for leg in self._evaluation.mechanism.legs]

    def source(self, signal: str) -> Any:
        """A signal before any lag, as it is sent."""
        return self._evaluation.signal(self._leg, signal, lag=False)

    def standing(self, name: str) -> float:
        """Value of a coordinate of this leg [its unit] in the standing pose."""
        return self._evaluation.mechanism.standing[full_name(self._leg, name)]

    def __getattr__(self, symbol: str) -> Any:
        if symbol in LEG_PORTS or symbol in BODY_PORTS:
            return PortAt(*self._evaluation.mechanism.motion(port_name(self._leg, symbol)))
        return self._evaluation.lookup(self._leg, symbol)
