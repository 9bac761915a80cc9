"""A task on a model becomes a nonlinear program.

Legend:

N   number of steps ("nodes" of a task); node k = 0 ... N ends step k, node 0 is the start
n   size of a node's vector y = [q, v, s, u, lam, h]:
    q, v   coordinates and velocities, of half a robot where a mirror symmetry is used
    s      states of effects, u inputs (torques, valves), lam forces and slip speeds
    h      the step that ends at this node
    Every entry is divided by the scale of its quantity. u, lam and h of node 0 are fixed dummies.
Y   (N + 1, n): all variables, row by row; the program's x is Y.ravel()
m   rows of one step, in this order: defects of kinematics, of motion, of rates; products of the
    pairs; signs of both sides of a pair; limits (see `stage`)
g   all rows: m rows of step 1, ..., m rows of step N; then the requirements that are no bounds,
    one block each over its nodes; then what holds in every state, at node 0
p   (5,): relaxation of the pairs and four weights (see `Parameters`)
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from kemba.mechanism.knee import felt
from kemba.model import Model
from kemba.ocp.functions.blocks import RowBlock, block_problem
from kemba.ocp.task.requirement import SCALES, Requirement, landing_nodes, quantity_expression
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.first_node import granted, state_rows
from kemba.ocp.transcription.layout import STEP, Layout
from kemba.ocp.transcription.level import GroundRise, ground_at_nodes
from kemba.ocp.transcription.stage import (
    INF,
    Interval,
    StageRows,
    aim_cost,
    as_variable,
    bounded_below,
    build_stage,
    requirement_row,
    tighter_bounds,
)
from kemba.ocp.transcription.symmetry import Reduction
from kemba.ocp.transcription.unilateral import rigid_constraints
from kemba.trajectory import Array


@dataclass(frozen=True)
class Parameters:
    """What one solve of a schedule sets.

    `eps`: relaxation of the pairs (body weights times metres or m/s). Weights in the cost:
    `valve` of u(1 - u) and `switching` of squared changes of u (both per node of the grid's mean),
    `pairs` of every pair's product, `forces` of squared scaled forces, `proximal` of half the
    squared distance from the start (scaled variables; not a parameter of the program itself).
    """

    eps: float
    valve: float = 0.0
    switching: float = 0.0
    pairs: float = 0.0
    forces: float = 0.0
    proximal: float = 0.0

    def vector(self, nodes: int) -> list[float]:
        """The program's parameters p (5,) on a grid of `nodes`."""
        return [self.eps, self.valve / nodes, self.switching / nodes, self.pairs, self.forces]


WITHIN = (0.25, 0.5, 0.75)  # of an interval: where obstacles are looked at besides its end
RequirementBlock = tuple[RowBlock, StageRows, list[int]]  # with the nodes at which its rows hold


@dataclass(frozen=True)
class Meaning:
    """What a row of the program says: kind, label, node."""

    kind: str
    label: str
    node: int


class Transcription:
    """The program of one task on one grid, see the legend above.

    With `rises` the ground is level and changes its height in flights: heights count from the
    `ground` (N + 1,) [m] of their node. `layout` says where each quantity is in y. `lower`, `upper`
    (N + 1, n) bound Y; `g_lower`, `g_upper` (rows,) bound g. `meanings` says what each row of g is;
    `problem` has the functions.
    """

    def __init__(
        self,
        model: Model,
        task: Task,
        requirements: Sequence[Requirement],
        reduction: Reduction,
        nodes: int,
        rises: Sequence[GroundRise] = (),
    ) -> None:
        self.model, self.task, self.requirements, self.nodes = model, task, requirements, nodes
        self.reduction = reduction
        self.layout = Layout(model, reduction, task.duration / nodes, task.step_variation)
        self.stage: Interval = build_stage(model, self.layout, reduction, task.cost)
        self.of_state = self.layout.reader(model.node, self.stage.y)
        n = self.layout.size
        self.shape = (nodes + 1, n + self.extra_columns())
        self.lower, self.upper = np.zeros(self.shape), np.zeros(self.shape)
        self.lower[:, :n], self.upper[:, :n] = self.layout.lower, self.layout.upper
        self._rest_before_start()
        stage = self.stage
        index = np.arange((nodes + 1) * self.shape[1]).reshape(self.shape)
        self.held: list[tuple[ca.SX, Requirement]] = []  # what holds exactly at the first node
        moments = self.requirement_blocks(index) + self._first_node_blocks(index)
        moments += self._aims(index) + self._soft_landing(index) + self._between_nodes(index)
        pairs = np.hstack([index[:-1, :n], index[1:, :n]])
        both, p = ca.vertcat(stage.y0, stage.y), ca.vertcat(stage.eps, stage.weights)
        blocks = [RowBlock(both, stage.g, stage.cost, pairs)]
        meanings = [m for k in range(1, nodes + 1) for r in stage.rows for m in _meanings(r, k)]
        g_bounds = [(r.lower, r.upper) for r in stage.rows for _ in r.labels] * nodes
        for block, rows, where in moments:
            blocks.append(block)
            meanings += [m for k in where for m in _meanings(rows, k)]
            g_bounds += [(rows.lower, rows.upper)] * len(where) * len(rows.labels)
        self.meanings = meanings
        self.g_lower, self.g_upper = (np.array(b) for b in zip(*g_bounds, strict=True))
        self.ground = ground_at_nodes(rises, nodes)
        for k in np.flatnonzero(np.diff(self.ground)) + 1:
            row = meanings.index(Meaning("defect", "kinematics:body/z", int(k)))
            rise = (self.ground[k] - self.ground[k - 1]) / self.layout.scale[self._height]
            self.g_lower[row] = self.g_upper[row] = -rise
        self.problem = block_problem(blocks, index.size, p, shared=True)

    @property
    def _height(self) -> int:
        """The column of Y that holds the body's height."""
        names = [q.name for q in self.layout.quantities["q"]]
        return int(self.layout.slices["q"].start) + names.index("body/z")

    def raised(self, Y: Array, sign: float = 1.0) -> Array:
        """Y (nodes + 1, n) with heights above the ground of the start, where those of the program
        count from the ground of their node; with a `sign` of -1 the reverse."""
        if not self.ground.any():
            return Y
        higher = np.zeros(Y.shape)
        higher[:, self._height] = sign * self.ground / self.layout.scale[self._height]
        return np.asarray(Y + higher)

    def _rest_before_start(self) -> None:
        """Inputs and forces of node 0 are fixed at zero and its step at the nominal one."""
        for group in ("u", "lam"):
            part = self.layout.slices[group]
            self.lower[0, part] = self.upper[0, part] = 0.0
        part = self.layout.slices["h"]
        self.lower[0, part] = self.upper[0, part] = self.task.duration / self.nodes / STEP

    def extra_columns(self) -> int:
        """Columns of Y behind the layout's own; zero unless `requirement_blocks` frees them."""
        return 0

    def requirement_blocks(self, index: np.ndarray) -> list[RequirementBlock]:
        """Requirements on plain variables tighten their bounds; the others become rows at nodes.

        `index` (nodes + 1, n): position of each node's variables in the full vector.
        """
        blocks = (self.hard(*asked, index) for asked in self.requirement_expressions())
        return [block for block in blocks if block is not None]

    def hard(
        self, requirement: Requirement, g: ca.SX, where: list[int], index: np.ndarray
    ) -> RequirementBlock | None:
        """The rows of a requirement that holds exactly; None where tighter bounds are enough.

        `g`: a scalar expression. `where`: the nodes at which it holds. `index` (nodes + 1, n):
        position of each node's variables in the full vector.
        """
        if requirement.minus is None:
            if 0 in where:
                self.held.append((g, requirement))
            variable = as_variable(g, self.stage.y)
            if variable is not None and self._tighten(where, variable, requirement):
                return None
        rows = requirement_row(g, requirement)
        return RowBlock(*self.local(requirement, rows.g, where, index)), rows, where

    def local(
        self, requirement: Requirement, g: ca.SX, where: list[int], index: np.ndarray
    ) -> tuple[ca.SX, ca.SX, ca.SX, np.ndarray]:
        """The block of a requirement: its local variables, rows `g`, no cost, and where they stand.

        Between two moments the variables are those of the earlier one and of each later one.
        """
        z, at = self.stage.y, index[where, : self.layout.size]
        if requirement.minus is not None:
            earlier = index[requirement.minus.node(self.nodes), : self.layout.size]
            z = ca.vertcat(self.stage.y0, z)
            at = np.hstack([np.tile(earlier, (len(where), 1)), at])
        return z, g, ca.SX(0), at

    def _first_node_blocks(self, index: np.ndarray) -> list[RequirementBlock]:
        """What holds in every state, at the first node; without what requirements there imply."""
        stage, node, blocks = self.stage, self.model.node, []
        for row in state_rows(node, self.reduction.pairs, self.reduction.limits):
            g = self.of_state(row.expression) / row.scale
            if bounded_below(g, stage.y, self.layout) or granted(
                g, stage.y, self.layout, self.held
            ):
                continue
            rows = StageRows(row.kind, g, 0.0, INF, [row.label])
            at = index[[0], : self.layout.size]
            blocks.append((RowBlock(stage.y, rows.g, ca.SX(0), at), rows, [0]))
        return blocks

    def _aims(self, index: np.ndarray) -> list[RequirementBlock]:
        """The cost of quantities that are to be as large or as small as possible."""
        if not any(r.aim for r in self.requirements):
            return []
        nothing = StageRows("requirement", ca.SX(0, 1), 0.0, 0.0, [])
        found: list[RequirementBlock] = []
        for requirement, g, where in self.requirement_expressions():
            if requirement.aim:
                z, _, _, at = self.local(requirement, g, where, index)
                found.append((RowBlock(z, nothing.g, aim_cost(requirement, g), at), nothing, []))
        return found

    def _soft_landing(self, index: np.ndarray) -> list[RequirementBlock]:
        """The speed of impacts after the apex, in the intervals that end at its later nodes."""
        speed, stage, n = self.task.landing.impact_speed, self.stage, self.layout.size
        if speed is None:
            return []
        step = self.task.duration / self.nodes
        rows = approach_rows(self.model, self.reduction, stage, self.of_state, speed, step)
        where = landing_nodes(self.requirements, self.nodes)
        if not where:  # the motion ends at the apex
            return []
        both = np.hstack([index[:-1, :n], index[1:, :n]])[np.array(where) - 1]
        return [(RowBlock(ca.vertcat(stage.y0, stage.y), rows.g, ca.SX(0), both), rows, where)]

    def _between_nodes(self, index: np.ndarray) -> list[RequirementBlock]:
        """Obstacles within every interval, so that no point gets through one in a single step."""
        stage, n, blocks = self.stage, self.layout.size, []
        ends = [self.layout.full(y, "q") for y in (stage.y0, stage.y)]
        both, where = np.hstack([index[:-1, :n], index[1:, :n]]), list(range(1, self.nodes + 1))
        kept = [r for r in self.requirements if r.location[0] == "obstacles" and r.always]
        for requirement in kept:
            room = quantity_expression(self.model, requirement.quantity.name)
            for share in WITHIN:
                q = (1 - share) * ends[0] + share * ends[1]
                rows = requirement_row(ca.substitute(room, self.model.node.q, q), requirement)
                block = RowBlock(ca.vertcat(stage.y0, stage.y), rows.g, ca.SX(0), both)
                blocks.append((block, rows, where))
        return blocks

    def requirement_expressions(self) -> Iterator[tuple[Requirement, ca.SX, list[int]]]:
        """Every requirement with its expression in the stage's y and the nodes where it holds.

        Those that the symmetry grants or repeats are left out.
        """
        seen: set[tuple[object, ...]] = set()
        for r in self.requirements:
            g = self.of_state(quantity_expression(self.model, r.quantity.name))
            if r.minus is not None:
                earlier = self.of_state(quantity_expression(self.model, r.minus.name))
                g = g - ca.substitute(earlier, self.stage.y, self.stage.y0)
            key = r.location, r.at, r.minus, r.during, str(g), r.lower, r.upper
            if ca.jacobian(g, self.stage.y).nnz() == 0 or key in seen:
                continue
            seen.add(key)
            yield r.on_nodes, g, r.nodes(self.nodes)

    def _tighten(
        self, where: list[int], variable: tuple[int, float, float], requirement: Requirement
    ) -> bool:
        """Whether the bounds of a variable can say a requirement; if so they do."""
        index, factor, offset = variable
        bounds = self.lower[where, index], self.upper[where, index]
        tighter = tighter_bounds(*bounds, factor, offset, requirement)
        if tighter is None:
            return False
        self.lower[where, index], self.upper[where, index] = tighter
        return True

    @property
    def variables(self) -> int:
        """Number of free variables."""
        return int(np.sum(self.lower < self.upper))

    @property
    def constraints(self) -> int:
        """Number of rows."""
        return len(self.g_lower)

    def h(self, Y: np.ndarray) -> np.ndarray:
        """Steps [s] (nodes,)."""
        return np.asarray(self.layout.half(Y, "h"))[1:, 0]

    def times(self, Y: np.ndarray) -> np.ndarray:
        """Times [s] of the nodes, from 0."""
        return np.concatenate([[0.0], np.cumsum(self.h(Y))])


def _meanings(rows: StageRows, node: int) -> list[Meaning]:
    return [Meaning(rows.kind, label, node) for label in rows.labels]


SPEED = SCALES["m.s-1"]


def approach_rows(
    model: Model,
    reduction: Reduction,
    stage: Interval,
    of_state: Callable[[ca.SX], ca.SX],
    speed: float,
    step: float,
) -> StageRows:
    """Rows of an interval: a gap that closes in it was closing at most at `speed` [m/s].

    rate(y0) + gap(y) / step >= -speed, stops by the length of the leg (`felt`). Where the gap stays
    open by more than it closes within a `step` [s], the row asks for nothing. `of_state`: an
    expression of the node in the stage's y. Feet on a ground that gives way have no rows: it stops
    them, however fast they come.
    """
    rows, labels = [], []
    for constraint in rigid_constraints(model, reduction):
        rate = ca.substitute(of_state(constraint.rate), stage.y, stage.y0)
        own = felt(model.mechanism, constraint.label)
        rows.append(own * (rate + of_state(constraint.gap) / step) / SPEED)
        labels.append(f"landing.impact_speed:{constraint.label}")
    return StageRows("requirement", ca.vertcat(*rows), -speed / SPEED, INF, labels)
