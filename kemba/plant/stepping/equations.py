"""The model's residual as the kernel needs it: machine code, and the structure of its pairs.

The residual is affine in accelerations and forces: 0 = M(q) a - F - B lam. The parts are taken
by AD from the model's own expressions, so the plant has no physics of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import casadi as ca
import numpy as np

from kemba.machine_code import Native
from kemba.model import SUPPLY, Model
from kemba.model.node import Node
from kemba.plant.kernel.machine import KernelModel
from kemba.plant.kernel.settings import StepLength
from kemba.plant.stepping.arrays import Array
from kemba.plant.stepping.compiled import Compiled
from kemba.plant.stepping.forms import Forms
from kemba.plant.stepping.imposed import impose
from kemba.plant.stepping.pairs import PairTable


def numbers_of(model: Model) -> dict[str, float]:
    """The supply of a model, its parameters, and the entries of its tables as `chamber.fill[0]`."""
    found = {SUPPLY: model.supply}
    found |= {name: value for name, (_, value) in model.parameters.items()}
    for effect in model.effects:
        for name, table in effect.tables().items():
            found |= {f"{effect.name}.{name}[{i}]": entry for i, entry in enumerate(table)}
    return found


class Equations:
    """What the plant knows of a model; `free` names its parameters that each run may change,
    `scaled` the entries of its tables, by a factor each.

    `machine` is for the kernel. `now(q, v, s, u)`: M (n, n), F (n,), B (n, nl) and f (ns,) at a
    state. `driven`: a step of the effect states when the motion is imposed. `measure`: outputs.
    """

    def __init__(self, model: Model, free: Sequence[str] = (), scaled: Sequence[str] = ()) -> None:
        self.free, self.scaled = tuple(free), tuple(scaled)
        self.node: Node = model.build(free, scaled) if free or scaled else model.node
        self._own = numbers_of(model)
        self.forms = Forms(self.node)
        self.pairs: PairTable = self.forms.pairs

    def values(self, model: Model) -> Array:
        """The free parameters and factors (np,) of a model that shares these equations."""
        there = numbers_of(model)
        factors = [
            there[name] / self._own[name] if self._own[name] else 1.0 for name in self.scaled
        ]
        return np.array([*(there[name] for name in self.free), *factors], dtype=float)

    @cached_property
    def machine(self) -> KernelModel:
        """The model as the kernel sees it."""
        address, pairs, nl = self.native.address, self.pairs, self.node.lam.numel()
        rigid = pairs.group[pairs.gaps[pairs.rigid]]
        slips = np.zeros((nl, nl), dtype=bool)
        for speed, rows in pairs.free_speeds:
            slips[speed, rows] = True
        return KernelModel(
            full=address["full"],
            smooth=address["smooth"],
            pairs=address["pairs"],
            outputs=address["outputs"],
            n=self.node.q.numel(),
            ns=self.node.s.numel(),
            nl=nl,
            gaps=pairs.gaps,
            rigid=pairs.rigid,
            group=pairs.group,
            ungapped=pairs.ungapped,
            hard=np.isin(pairs.group, rigid),
            slips=slips,
            scale=self._scale,
        )

    @property
    def _scale(self) -> Array:
        """Usual sizes of velocities and effect states."""
        states = [row.scale for row in self.node.rate_rows]
        usual = StepLength.current()
        rows = self.node.dynamics_rows
        speeds = [usual.speed if row.unit == "N" else usual.spin for row in rows]
        return np.array([*speeds, *states])

    @cached_property
    def native(self) -> Native:
        """The model's functions in machine code, as `KernelModel` describes them."""
        node, forms = self.node, self.forms
        M, F, B, f = forms.parts
        n, ns = node.q.numel(), node.s.numel()
        blank = ca.SX(n, n), ca.SX(ns, ns)
        x = [node.q, node.v, node.s, node.u, node.p, node.a, node.lam]
        rest = ca.SX.zeros(ns)
        functions = {
            "full": [ca.horzcat(forms.D, M, F, B), ca.horzcat(forms.A, f)],
            "smooth": [ca.horzcat(blank[0], M, F, B), ca.horzcat(blank[1], f)],
            "pairs": [ca.horzcat(self.pairs.W, self.pairs.L, self.pairs.w0), self.pairs.gap],
            "outputs": ca.substitute([self._outputs], [node.sd], [rest]),
        }
        return Native(x, functions)

    @cached_property
    def now(self) -> Compiled:
        """M, F, B and f at a state."""
        parts = dict(zip(("M", "F", "B", "f"), self.forms.parts, strict=True))
        return Compiled("now", self._symbols("q", "v", "s", "u"), parts)

    @cached_property
    def driven(self) -> Compiled:
        """A step of the effect states along an imposed motion."""
        return Compiled("driven", *impose(self.forms, self._symbols("q", "v", "s", "u")))

    @cached_property
    def measure(self) -> Compiled:
        """The outputs."""
        symbols = self._symbols("q", "v", "a", "s", "sd", "lam", "u")
        return Compiled("measure", symbols, {"y": self._outputs})

    @property
    def _outputs(self) -> ca.SX:
        return ca.SX(ca.vertcat(*(self.node.outputs[o.name] for o in self.node.output_quantities)))

    def _symbols(self, *names: str) -> dict[str, ca.SX]:
        return {name: getattr(self.node, name) for name in names}
