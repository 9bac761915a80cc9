"""The model's residual as the kernel needs it: machine code, and the structure of its pairs.

The residual is affine in accelerations and forces: 0 = M(q) a - F - B lam. The parts are taken
by AD from the model's own expressions, so the plant has no physics of its own.

Every pair has one side that is a force symbol of its own (z) and an expression on the other (w).
Where w without forces depends on coordinates only it is a gap: rigid, held at velocity level, or
compliant, with a force that follows from its depth. Otherwise it is already a relation between
velocities and forces, such as a friction cone.
"""

import weakref
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from kemba.cache import Recent
from kemba.errors import KembaError
from kemba.machine_code import Native
from kemba.mechanism import Mechanism
from kemba.model import SUPPLY, Model
from kemba.model.model import Node
from kemba.model.rest import rate_of
from kemba.plant.kernel.machine import SPEED, SPIN, Array, KernelModel


@dataclass(frozen=True)
class PairTable:
    """Pairs ordered by their force: row i is the pair of lam[i].

    `gap` (ng, 1) holds the expressions of the position pairs and `gaps` their rows; `group`
    numbers the effect instance of each row. w = W v + L lam + w0, where a rigid gap has its
    Jacobian in W and w0 = 0, and a compliant one, which yields with its force, W = 0 and w0 the
    gap itself. `free_speeds`: rows of slip speeds, with the rows of slip they bound; an open
    contact leaves them undetermined.
    """

    labels: tuple[str, ...]
    gap: ca.SX
    gaps: Array
    rigid: Array  # (ng,) whether each gap is rigid
    group: Array
    W: ca.SX
    L: ca.SX
    w0: ca.SX
    free_speeds: tuple[tuple[int, Array], ...] = ()

    @cached_property
    def ungapped(self) -> Array:
        """Whether each row belongs to an instance without gaps, which cannot open."""
        return ~np.isin(self.group, self.group[self.gaps])


def read_pairs(node: Any) -> PairTable:
    """The pair table of a node. Raises KembaError where a pair has no force of its own."""
    size = node.lam.numel()
    rows: dict[int, tuple[str, ca.SX]] = {}
    for i in range(node.pair_a.numel()):
        label = node.pair_rows[i][0].label
        index, other = _split(node, node.pair_a[i], node.pair_b[i], rows, label)
        rows[index] = (label, other)
    for i in range(size):
        if i not in rows:
            raise KembaError(str(node.lam[i]), "no complementarity pair determines this force")
    return _table(node, [rows[i] for i in range(size)])


def _split(node: Any, a: ca.SX, b: ca.SX, taken: dict[int, Any], label: str) -> tuple[int, ca.SX]:
    for side, other in ((b, a), (a, b)):
        for j in range(node.lam.numel()):
            if j not in taken and ca.is_equal(side, node.lam[j]):
                return j, other
    raise KembaError(label, "neither side of this pair is a force of its own")


def _table(node: Any, rows: list[tuple[str, ca.SX]]) -> PairTable:
    labels = tuple(label for label, _ in rows)
    w = ca.SX(ca.vertcat(*(other for _, other in rows)))
    L = ca.jacobian(w, node.lam)
    if rows and _depends(L, ca.vertcat(node.lam, node.a)):
        raise KembaError(labels[0], "the pairs are not linear in the forces")
    base = ca.substitute([w], [node.lam], [ca.SX.zeros(node.lam.numel())])[0]
    moving = ca.vertcat(node.v, node.s, node.u)
    gaps = [
        i for i in range(len(rows)) if _depends(base[i], node.q) and not _depends(base[i], moving)
    ]
    rigid = [L[i, :].nnz() == 0 for i in gaps]
    W, w0 = ca.jacobian(base, node.v), base - ca.jtimes(base, node.v, node.v)
    for i, firm in zip(gaps, rigid, strict=True):
        if firm:
            W[i, :], w0[i] = ca.jacobian(base[i], node.q), 0
    gap = ca.SX(ca.vertcat(*(base[i] for i in gaps))) if gaps else ca.SX.zeros(0, 1)
    instances = [label.rsplit(":", 1)[0] for label in labels]
    order = list(dict.fromkeys(instances))
    group = np.array([order.index(name) for name in instances], dtype=int)
    index, hard = np.array(gaps, dtype=int), np.array(rigid, dtype=bool)
    slips = _free_speeds(W, L, gaps, group)
    return PairTable(labels, gap, index, hard, group, W, L, w0, slips)


def _free_speeds(
    W: ca.SX, L: ca.SX, gaps: list[int], group: Array
) -> tuple[tuple[int, Array], ...]:
    """Forces that enter relations between velocities with weight 1, such as slip speeds."""
    found = []
    for column in range(len(group)):
        rows = [i for i in range(len(group)) if W[i, :].nnz() and L[i, column].is_one()]
        if rows and group[rows[0]] in group[gaps]:
            found.append((column, np.array(rows)))
    return tuple(found)


def _depends(expression: ca.SX, symbols: ca.SX) -> bool:
    return any(ca.which_depends(ca.vec(expression), symbols, 1, True))


def _affine(node: Node) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    """M (n, n), F (n,), B (n, nl) and f (ns,) of a node. Raises KembaError where an effect breaks
    the affine form."""
    M, B = ca.jacobian(node.dynamics, node.a), -ca.jacobian(node.dynamics, node.lam)
    f = rate_of(node)
    moving = ca.vertcat(node.a, node.lam, node.sd)
    for rows, form in ((node.dynamics_rows, ca.horzcat(M, B)), (node.rate_rows, f)):
        if form.numel() and any(ca.which_depends(ca.vec(ca.densify(form)), moving, 1, True)):
            what = "is not affine in accelerations and forces"
            raise KembaError(rows[0].label, what, "the plant steps only such models")
    zero = [ca.SX.zeros(node.a.numel()), ca.SX.zeros(node.lam.numel())]
    bias = ca.substitute([node.dynamics], [node.a, node.lam], zero)[0]
    return M, -bias, B, f


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

    `machine` is for the kernel; `parts`: M (n, n), F (n,), B (n, nl) and f (ns,) as expressions of
    the node's q, v, s, u and p.
    """

    def __init__(self, model: Model, free: Sequence[str] = (), scaled: Sequence[str] = ()) -> None:
        self.free, self.scaled = tuple(free), tuple(scaled)
        self.node: Node = model.build(free, scaled) if free or scaled else model.node
        self._own = numbers_of(model)
        self.pairs, self.parts = read_pairs(self.node), _affine(self.node)

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
        rows = self.node.dynamics_rows
        speeds = [SPEED if row.unit == "N" else SPIN for row in rows]
        return np.array([*speeds, *states])

    @cached_property
    def native(self) -> Native:
        """The model's functions in machine code, as `KernelModel` describes them."""
        node, (M, F, B, f) = self.node, self.parts
        D, A = ca.jacobian(F, node.v), ca.jacobian(f, node.s)
        x = [node.q, node.v, node.s, node.u, node.p, node.a, node.lam]
        outputs = ca.SX(ca.vertcat(*(node.outputs[o.name] for o in node.output_quantities)))
        functions = {
            "full": [ca.horzcat(D, M, F, B), ca.horzcat(A, f)],
            "smooth": [ca.horzcat(ca.SX(*D.shape), M, F, B), ca.horzcat(ca.SX(*A.shape), f)],
            "pairs": [ca.horzcat(self.pairs.W, self.pairs.L, self.pairs.w0), self.pairs.gap],
            "outputs": [ca.substitute(outputs, node.sd, ca.SX.zeros(node.sd.numel()))],
        }
        return Native(x, functions)


# models whose machine code is kept (twice those of a plan: its model and its plant, each with
# fitted air)
MODELS = 8


@dataclass
class Family:
    """Models of one mechanism with the same effects: `numbers` are those of the first of them."""

    structure: tuple[Any, ...]
    numbers: dict[str, float]
    equations: Equations


_OF_MODEL: weakref.WeakKeyDictionary[Model, Equations] = weakref.WeakKeyDictionary()
_FAMILIES: dict[int, list[Family]] = {}  # by the identity of the mechanism
_PLAIN: Recent[tuple[Any, ...], Equations] = Recent()  # by what a model consists of


def equations_of(model: Model) -> Equations:
    """The equations of a model. Models that differ in numbers only share them: what differs is a
    parameter of the machine code then, see `Equations.values`."""
    share_equations([model])
    return _OF_MODEL[model]


def share_equations(models: Iterable[Model]) -> None:
    """Make the equations of models that are simulated together: all that differs among those of a
    family is free at once, so that its machine code is made once."""
    found = [(model, _family(model)) for model in models if model not in _OF_MODEL]
    for model, family in found:
        _OF_MODEL[model] = family.equations


def _family(model: Model) -> Family:
    """The family of a model, in whose equations all is free in which this one differs."""
    structure, numbers = _structure(model), numbers_of(model)
    families = _families(model.mechanism)
    for family in families:
        if family.structure == structure:
            known = {*family.equations.free, *family.equations.scaled}
            new = {name for name, value in numbers.items() if value != family.numbers[name]}
            if not new <= known:
                family.equations = _with_free(model, known | new)
            return family
    families.append(Family(structure, numbers, _plain(model, structure, numbers)))
    return families[-1]


def _plain(model: Model, structure: tuple[Any, ...], numbers: dict[str, float]) -> Equations:
    """Equations without free numbers. They are the same for equal models, whatever was simulated
    before, so that a process that plans again and again makes them once."""
    mechanism = model.mechanism
    if mechanism.drawn is None:
        return Equations(model)
    lengths = tuple(sorted(mechanism.offsets.items()))
    robot = mechanism.drawn.model_dump_json(), lengths, repr(mechanism.scene.dump())
    key = (robot, structure, tuple(numbers.items()))
    return _PLAIN.get(key, lambda: Equations(model), MODELS)


def _with_free(model: Model, names: set[str]) -> Equations:
    """Equations in which `names` are free; of an effect one of whose tables is among them, all
    tables, since a fit changes one after the other."""
    entries = numbers_of(model).keys() - model.parameters.keys() - {SUPPLY}
    effects = {name.rpartition(".")[0] for name in names & entries}
    scaled = sorted(name for name in entries if name.rpartition(".")[0] in effects)
    return Equations(model, sorted(names - entries), scaled)


def _families(mechanism: Mechanism) -> list[Family]:
    key = id(mechanism)
    if key not in _FAMILIES:
        _FAMILIES[key] = []
        weakref.finalize(mechanism, _FAMILIES.pop, key, None)
    return _FAMILIES[key]


def _structure(model: Model) -> tuple[Any, ...]:
    """What models must have in common to share equations: all but the numbers of the effects, and
    which entries of their tables are zero, since no factor changes these."""
    effects = []
    for effect in model.effects:
        tables = effect.tables()
        apart = {*effect.parameters(), *tables}
        rest = {name: value for name, value in effect.model_dump().items() if name not in apart}
        zeros = [[entry == 0.0 for entry in table] for table in tables.values()]
        effects.append((type(effect), repr((rest, zeros))))
    return tuple(effects)
