"""Numeric functions of a robot model along measured motion, mapped over many samples at once."""

from collections.abc import Mapping
from functools import cached_property

import casadi as ca
import numpy as np

from kemba.identify.problem.candidates import (
    leg_by_leg,
    link_figures,
    nominal_figures,
    without_delay,
)
from kemba.identify.problem.problem import Array, Theta
from kemba.machine_code import SampleMap
from kemba.mechanism.robot import link_regressors
from kemba.model.model import Model
from kemba.model.rest import Index, StatesAlong, rate_of

FOLDED = 2.9  # rad; a knee folds less far, whatever the lengths of its leg
REACH = 4.0  # largest error, in sigmas: beyond chance
LEAST = 0.2  # smallest value, as a share of the nominal one


class Physics:
    """Residual forces, state rates and kinematics of `model`, vectorised over samples.

    Contact and end stops are left out: where they act is read from the data. `names` are the free
    parameters in the order of every `p`, those of `free` first, then the nuisance ones. `figures`:
    nuisance parameters that are known less well, with value and 1 sigma: of every leg alike; a
    table is scaled. `links`: figures of links that may be off, as `Problem.nuisance`; they are no
    part of `p`.
    """

    def __init__(
        self,
        model: Model,
        free: tuple[str, ...],
        grip: float = 1.0,
        figures: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        self.base = model
        self.model = leg_by_leg(model)
        plain = {n: v for n, v in (figures or {}).items() if n in model.parameters}
        tables = {n: v for n, v in (figures or {}).items() if n not in plain}
        scaled = {**tables, **nominal_figures(self.model, free)}
        self.nuisance = {**plain, **scaled}
        self.links = link_figures(model)
        self.names = (*free, *self.nuisance)
        self.nominal = np.array(
            [model.parameters[n][1] for n in free] + [v for v, _ in self.nuisance.values()]
        )
        self.bounds = self._bounds(figures or {})
        self.node = node = self.model.build((*free, *plain), scaled)
        self.p = node.p
        self.mechanism, self.legs = model.mechanism, model.mechanism.legs
        self.inputs = tuple(q.name for q in self.model.inputs.values())
        rate = rate_of(node)
        self.moves = np.array(ca.which_depends(rate, self.p, 1), dtype=bool)
        self.moving = [n for n, moves in zip(self.names, self.moves, strict=True) if moves]
        p = ca.vertcat(*(self.p[int(i)] for i in np.flatnonzero(self.moves)))
        states = list(self.model.states.values())
        self.states = StatesAlong(node.s, [node.q, node.v, node.u, p], rate, states)
        self._rate = rate
        self.lengths = np.array([n.startswith("geometry:") for n in self.names])
        self.grip = grip
        self._maps: dict[str, SampleMap] = {}
        self._needed: dict[tuple[int, ...], Index] = {}
        self._place = {name: i for i, name in enumerate(self.names)}
        pairs = zip(self.names, self.nominal, strict=True)
        self._usual = np.array([without_delay(name, value) for name, value in pairs])
        self._knees: dict[tuple[int, bytes], tuple[Array, Array]] = {}

    def at(self, theta: Theta) -> Array:
        """Free parameters (k,) at theta, within their bounds."""
        p = self._usual.copy()
        for name, value in theta.items():
            if (i := self._place.get(name)) is not None:
                p[i] = without_delay(name, value)
        return np.asarray(np.clip(p, *self.bounds))

    def timing(self, theta: Theta) -> Array:
        """Delays (valves, 2) [s] to switching on and off at theta."""
        late = [self.base.timing(leg, theta) for leg in self.legs]
        return np.repeat(late, 2, axis=0)  # both valves of a leg

    def _bounds(self, figures: Mapping[str, tuple[float, float]]) -> tuple[Array, Array]:
        """Smallest and largest value (k,) of every parameter; `figures` stay possible."""
        lower, upper = np.full(len(self.names), -np.inf), np.full(len(self.names), np.inf)
        for name, (value, sigma) in figures.items():
            i, reach = self.names.index(name), REACH * sigma
            declared = self.base.parameters[name][0] if name in self.base.parameters else None
            lower[i] = max(value - reach, LEAST * value)
            upper[i] = min(value + reach, declared.upper if declared else np.inf)
        return lower, upper

    @property
    def channels(self) -> tuple[str, ...]:
        """Measured channels, one per coordinate: the knees are measured by their pistons."""
        pistons = tuple(f"{leg}/piston/x" for leg in self.legs)
        return tuple(c.name for c in self.mechanism.coordinates[: 3 + len(self.legs)]) + pistons

    @cached_property
    def functions(self) -> dict[str, tuple[list[ca.SX], list[ca.SX]]]:
        """Inputs and outputs of all functions of samples, by name."""
        node = self.node
        r = self._force
        full = [node.q, node.v, node.a, node.s, node.u, self.p]
        y = ca.vertcat(*(node.outputs[name] for name in self.channels))
        feet, feet_rate, feet_slope = self._feet()
        motion = [node.q, node.v, self.p]
        regress = link_regressors(self.mechanism)
        coordinates = regress.sx_in()
        return {
            "residual": (full, [r]),
            "mass": (full, [ca.jacobian(r, node.a)]),
            "stiffness": (full, [ca.jacobian(r, x) for x in (node.q, node.v)]),
            "by_parameter": (full, [ca.jacobian(r, self.p)]),
            "measured": (motion, [y, ca.jtimes(y, node.q, node.v), ca.jacobian(y, node.q)]),
            "feet": (motion, [feet, feet_rate, feet_slope]),
            "seen": (motion, [y, feet]),
            "links": (coordinates, regress.call(coordinates)),
        }

    def _feet(self) -> tuple[ca.SX, ca.SX, ca.SX]:
        """Of feet: x and distance from the ground; rates, slopes along it and out of it."""
        node, ground, found = self.node, self.mechanism.scene.ground, []
        for leg in self.legs:
            foot = ca.vertcat(*(node.outputs[f"{leg}/foot/{axis}"] for axis in "xz"))
            x, z = ca.vertsplit(foot)
            across, up = ground.normal(x)
            frame = ca.vertcat(ca.horzcat(up, -across), ca.horzcat(across, up))
            rates = frame @ ca.jtimes(foot, node.q, node.v)
            place = ca.vertcat(x, up * (z - ground.height(x)))
            found.append((place, rates, frame @ ca.jacobian(foot, node.q)))
        places, rates, slopes = (ca.vertcat(*parts) for parts in zip(*found, strict=True))
        return places, rates, slopes

    def states_at(self, p: Array) -> Index:
        """Effect states that forces at p (k,) depend on."""
        key = tuple(i for i in self._switches if p[i] == 0.0)
        if key not in self._needed:
            zero = self.p[list(key)]
            bare = ca.substitute([self._force, self._rate], [zero], [ca.SX.zeros(zero.shape)])
            force, follows = (ca.jacobian_sparsity(x, self.node.s).get_triplet() for x in bare)
            found, pairs = set(force[1]), list(zip(*follows, strict=True))
            while more := {of for state, of in pairs if state in found} - found:
                found |= more
            self._needed[key] = np.array(sorted(found), dtype=int)
        return self._needed[key]

    @cached_property
    def _switches(self) -> list[int]:
        """Parameters that switch effects with states on."""
        named = {
            f"{effect.name}.{field}"
            for effect in self.base.effects
            if effect.states()
            for field, off in effect.off.items()
            if off == 0.0
        }
        return [i for i, name in enumerate(self.names) if name in named]

    @property
    def _force(self) -> ca.SX:
        """Generalised force (n,) that a motion needs beyond model and contact."""
        return ca.substitute(self.node.dynamics, self.node.lam, 0 * self.node.lam)

    def call(self, name: str, *samples: Array, p: Array | None = None) -> list[Array]:
        """Function `name` over samples (N, .): arrays (N, rows) or (N, rows, columns)."""
        if name not in self._maps:
            self._maps[name] = SampleMap(*self.functions[name])
        return self._maps[name](samples, p)

    def knees(self, pistons: Array, p: Array) -> Array:
        """Knee coordinates (n, legs) of piston extensions (n, legs) at parameters p (k,)."""
        return np.column_stack(
            [np.interp(pistons[:, i], *self._knee(i, p)) for i in range(len(self.legs))]
        )

    def _knee(self, i: int, p: Array) -> tuple[Array, Array]:
        """Piston extension, increasing, and knee angle on a grid; the same for equal lengths."""
        key = (i, p[self.lengths].tobytes())
        if key not in self._knees:
            self._knees = {k: v for k, v in self._knees.items() if k[1] == key[1]}
            m, k = self.mechanism, 3 + len(self.legs) + i
            low, high = m.coordinates[k].lower, m.coordinates[k].upper
            grid = np.sign(low + high) * np.linspace(0.0, FOLDED, 4001)
            q = np.zeros((len(grid), m.n))
            q[:, k] = grid
            x = self.call("measured", q, 0 * q, p=p)[0][:, k]
            order = np.argsort(x)
            self._knees[key] = x[order], grid[order]
        return self._knees[key]

    def arrange(self, torque: Array, valves: Array) -> Array:
        """Inputs (nu, N) in the model's order from torques (legs, N) and valves (2 legs, N)."""
        rows = {f"{leg}/hip/tau": torque[i] for i, leg in enumerate(self.legs)}
        for i, leg in enumerate(self.legs):
            rows[f"{leg}/valve/extend"], rows[f"{leg}/valve/retract"] = valves[2 * i : 2 * i + 2]
        return np.stack([rows[name] for name in self.inputs])
