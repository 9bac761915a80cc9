"""Effect states of a model: where they come to rest while its motion and commands are held, and how
they go along a motion and inputs that are given, by the exponential midpoint rule.

It is of second order, exact for a lag of constant input however short, and stable where the states
are stiff: air that flows between nearly equal pressures answers within a fifth of a millisecond.
"""

from collections.abc import Mapping, Sequence
from typing import Any
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np
from typing_extensions import Self

from kemba.errors import KembaError
from kemba.machine_code import Native
from kemba.model.model import Model, Node
from kemba.quantity import Quantity
from kemba.trajectory import Trajectory

Array = np.ndarray[Any, np.dtype[np.float64]]
Index = np.ndarray[Any, np.dtype[np.int_]]
Known = Trajectory | Mapping[str, float]


# s; time after which states count as at rest; a leak would empty any tank in the end (ten times
# the recovery of a usual supply, 0.3 s)
WAIT = 3.0
STILL = 1e-6  # s-1; rate, in scales of a state, below which it rests
STEPS = 8  # steps of Newton's method, before the wait is simulated
# share of a change that is left after the wait, below which a state has settled (a supply that
# recovers within 0.3 s has 5e-5 left)
LEFT = 1e-4
TOLERANCE = 1e-9  # of the integration, in scales of the states


class Buffered:
    """A function of dense arrays with dense results, called without CasADi's own matrices."""

    def __init__(self, function: ca.Function) -> None:
        buffer: Any
        buffer, self._evaluate = function.buffer()
        given = [np.zeros(function.numel_in(i)) for i in range(function.n_in())]
        found = [np.zeros(function.numel_out(i)) for i in range(function.n_out())]
        for i, flat in enumerate(given):
            buffer.set_arg(i, flat.data)
        for i, flat in enumerate(found):
            buffer.set_res(i, flat.data)
        self._given = [a.reshape(function.size_in(i), order="F") for i, a in enumerate(given)]
        self._found = [a.reshape(function.size_out(i), order="F") for i, a in enumerate(found)]
        self._buffer = buffer  # the evaluation holds no reference to it

    def __call__(self, *arrays: Array) -> list[Array]:
        """The results, which hold until the next call."""
        for given, values in zip(self._given, arrays, strict=True):
            given[:] = np.reshape(values, given.shape)
        self._evaluate()
        return self._found


class Rest:
    """The states after a long wait: of ds/dt = rate(s, held) with `held` constant."""

    def __init__(
        self, s: ca.SX, held: Sequence[ca.SX], rate: ca.SX, quantities: Sequence[Quantity]
    ) -> None:
        self._start = np.array([q.value for q in quantities], dtype=float)
        self._scale = np.array([q.scale for q in quantities], dtype=float)
        if not quantities:
            return
        x, p = ca.SX.sym("x", s.numel()), ca.SX(ca.vertcat(*held))
        scaled = ca.substitute(rate, s, x * self._scale) / self._scale
        slope = ca.densify(ca.jacobian(scaled, x))
        self._changes = Buffered(ca.Function("changes", [x, p], [ca.densify(scaled), slope]))
        options = {"abstol": TOLERANCE, "reltol": TOLERANCE}
        options["disable_internal_warnings"] = True  # what did not settle is told by KembaError
        equation = {"x": x, "p": p, "ode": scaled}
        self._wait = ca.integrator("wait", "cvodes", equation, 0.0, WAIT, options)

    def __call__(self, *held: Any) -> Array:
        """The states (ns,) with `held` in the order of the symbols; they begin at their nominal
        values. Raises KembaError where they grow without bound."""
        if not len(self._start):
            return np.empty(0)
        x, p = self._start / self._scale, np.hstack([[], *map(np.ravel, held)])
        settled = self._settled(x, p)
        if settled is not None:
            return np.asarray(settled * self._scale)
        try:
            found = self._wait(x0=x, p=p)["xf"]
        except RuntimeError:
            what = "the states of its effects do not come to rest while everything is held"
            raise KembaError("model", what, hint="does an effect feed itself?") from None
        return np.asarray(np.asarray(found).ravel() * self._scale)

    def _settled(self, x: Array, p: Array) -> Array | None:
        """Where scaled states (ns,) do not change any more, by Newton's method from x; None where
        it finds no such place, or a state would get there after the wait only."""
        for step in range(STEPS):
            moving, slope = self._changes(x, p)
            still = bool(np.all(np.abs(moving) <= STILL))
            if still and not step:
                return x  # nothing moves
            if not (np.isfinite(moving).all() and np.isfinite(slope).all()):
                return None
            if still:
                slowest = float(np.linalg.eigvals(slope).real.max())
                return x if slowest * WAIT < np.log(LEFT) else None
            try:
                x = x - np.linalg.solve(slope, moving).ravel()
            except np.linalg.LinAlgError:
                return None
        return None


_KNOWN: WeakKeyDictionary[Model, Rest] = WeakKeyDictionary()


def at_rest(model: Model, q: Any, u: Any) -> Array:
    """Effect states (ns,) of a model at rest at coordinates q (nq,) and inputs u (nu,)."""
    if model not in _KNOWN:
        node = model.node
        still = ca.substitute(rate_of(node), node.v, ca.SX.zeros(node.v.numel()))
        _KNOWN[model] = Rest(node.s, [node.q, node.u], still, list(model.states.values()))
    return _KNOWN[model](q, u)


def told_by(model: Model, s: Array, plan: Known) -> dict[int, Array]:
    """Effect states (n,), by their number, that follow from what a plan has of the model's outputs:
    the pressure of a chamber from its force. Outputs are linear in such a state; `s` (ns,): where
    the slope is taken. States that the plan itself has are left out."""
    node, found = model.node, dict[int, Array]()
    unknown = [i for i, q in enumerate(model.states.values()) if q.name not in plan]
    for name, i in telling(model).items() if unknown else ():
        if name in plan and i in unknown:
            value = node.outputs[name]
            f = ca.Function("f", [node.s[i]], [value, ca.gradient(value, node.s[i])])
            there, slope = (float(x) for x in f(s[i]))
            found[i] = s[i] + (np.asarray(plan[name]) - there) / slope
    return found


def telling(model: Model) -> dict[str, int]:
    """The outputs of a model that depend on one effect state alone, with the number of that."""
    node = model.node
    number = {str(node.s[i]): i for i in range(node.s.numel())}
    found = {name: ca.symvar(ca.SX(value)) for name, value in node.outputs.items()}
    return {
        name: number[str(symbols[0])]
        for name, symbols in found.items()
        if len(symbols) == 1 and str(symbols[0]) in number
    }


MOVES = 1e-6  # m/s or rad/s; slower is rest


def moving_start(model: Model, plan: Trajectory) -> dict[str, float]:
    """What a plan of `model` that begins in motion says of its first state beyond the pose: rates,
    inputs, effect states and the outputs that tell these. Empty where it begins at rest."""
    rates = [q.name for q in model.mechanism.velocities if q.name in plan]
    if not any(abs(plan[name][0]) > MOVES for name in rates):
        return {}
    first = min(1, len(plan) - 1)  # inputs act on the interval before a node
    inputs = {i.name: float(plan[i.name][first]) for i in model.inputs.values() if i.name in plan}
    states = [q.name for q in model.states.values()]
    names = [name for name in (*rates, *states, *telling(model)) if name in plan]
    return {**inputs, **{name: float(plan[name][0]) for name in names}}


def state_at(model: Model, q: Array, start: Mapping[str, float]) -> dict[str, float]:
    """Rates and effect states of a machine in the pose q (nq,) at the `start` of a motion.

    What the machine computes (the force of a chamber) and the start has gives the state it comes of
    (the pressure). States of which the start says nothing are where they come to rest while its
    inputs are held. Raises KembaError as `at_rest` does.
    """
    u = [start.get(i.name, 0.0) for i in model.inputs.values()]
    s = at_rest(model, q, u)
    for i, value in told_by(model, s, start).items():
        s[i] = value
    states = dict(zip((quantity.name for quantity in model.states.values()), s, strict=True))
    known = (*states, *(v.name for v in model.mechanism.velocities))
    given = {name: start[name] for name in known if name in start}
    return {name: float(value) for name, value in (states | given).items()}


def rate_of(node: Node) -> ca.SX:
    """ds/dt (ns,) of a node, whose rows say sd - ds/dt = 0."""
    return -ca.substitute(node.rate, node.sd, ca.SX.zeros(node.sd.numel()))


def midpoint_step(
    rate: ca.SX, s: ca.SX, inputs: Sequence[ca.SX], given: Sequence[ca.SX], h: ca.SX
) -> tuple[ca.SX, ca.SX]:
    """States (ns,) after a step h [s] from s, and their mean over it, by ds/dt = rate(s, inputs)
    with the inputs held at `given`, their values in the middle of the step."""
    f = ca.Function("f", [s, *inputs], [rate, ca.diag(ca.jacobian(rate, s))])
    middle = s + _grown(h / 2, *f(s, *given))
    slope, stiff = f(middle, *given)
    slope = slope - stiff * (middle - s)
    return s + _grown(h, slope, stiff), s + _mean_growth(h, slope, stiff)


def _grown(h: ca.SX, slope: ca.SX, stiff: ca.SX) -> ca.SX:
    """h phi(h stiff) slope with phi(z) = (exp(z) - 1)/z."""
    z = h * stiff
    small = ca.fabs(z) < 1e-6
    return h * slope * ca.if_else(small, 1 + z / 2, (ca.exp(z) - 1) / ca.if_else(small, 1, z))


def _mean_growth(h: ca.SX, slope: ca.SX, stiff: ca.SX) -> ca.SX:
    """Mean of the growth over the step: h slope (exp(z) - 1 - z)/z^2."""
    z = h * stiff
    small = ca.fabs(z) < 1e-3
    safe = ca.if_else(small, 1, z)
    return h * slope * ca.if_else(small, 0.5 + z / 6, (ca.exp(z) - 1 - z) / safe**2)


class StatesAlong:
    """The states (ns,) of effects along what is given: ds/dt = rate(s, *held), step by step.

    `held`: what each step has in its middle, such as coordinates and inputs, and last the
    parameters, which are the same in all steps. `rest`: where the states come to rest with all of
    these held.
    """

    def __init__(
        self, s: ca.SX, held: Sequence[ca.SX], rate: ca.SX, quantities: Sequence[Quantity]
    ) -> None:
        self.rest = Rest(s, held, rate, quantities)
        self._s, self._held, self._rate = s, list(held), rate
        self.width = 1 + sum(symbol.numel() for symbol in held[:-1])  # of what is given
        self._codes: dict[bytes, Native] = {}

    @classmethod
    def of(cls, model: Model, node: Node) -> Self:
        """Those of a model along coordinates, their rates and accelerations, and inputs."""
        held = [node.q, node.v, node.a, node.u, node.p]
        return cls(node.s, held, rate_of(node), list(model.states.values()))

    def run(
        self, start: Array, given: Array, p: Array, among: Index | None = None
    ) -> tuple[Array, Array]:
        """States (n + 1, ns) from `start` (ns,) over n steps, and their means (n, ns) over these.

        `given` (n, width): length [s] of each step, and what is held over it; `p` (k,): parameters.
        `among`: states that are asked for, and that depend on no others (None: all); the others
        stay where they start.
        """
        own, n = np.arange(len(start)) if among is None else among, len(given)
        after, means = np.tile(start, (n + 1, 1)), np.tile(start, (n, 1))
        if not len(own):
            return after, means
        known = np.hstack([given, np.broadcast_to(p, (n, len(p)))])
        x = np.zeros((n + 1, len(own) + known.shape[1]))
        x[0, : len(own)], x[:-1, len(own) :] = start[own], known
        mean = np.zeros((n, len(own)))
        # each step begins where the one before has ended
        self._code(own).rows("step", x[:-1], x[1:, : len(own)], mean)
        after[:, own], means[:, own] = x[:, : len(own)], mean
        return after, means

    def _code(self, own: Index) -> Native:
        """A step of these states."""
        key = own.tobytes()
        if key not in self._codes:
            h, at = ca.SX.sym("h"), own.tolist()
            step = midpoint_step(self._rate[at], self._s[at], self._held, self._held, h)
            self._codes[key] = Native([self._s[at], h, *self._held], {"step": step})
        return self._codes[key]
