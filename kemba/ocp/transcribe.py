"""A task on a model becomes a nonlinear program: grid, bounds, rows, and what each one means."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from kemba.model import Model
from kemba.ocp.blocks import Block, BlockProblem
from kemba.ocp.layout import GROUPS, Layout
from kemba.ocp.mirror import Reduction
from kemba.ocp.stage import INF, Rows, Stage, as_variable, build_stage
from kemba.ocp.task import Task
from kemba.ocp.wishes import Wish, quantity_expression


@dataclass(frozen=True)
class Meaning:
    """What a row of the program says: kind, label, node, and the size of a violation."""

    kind: str
    label: str
    unit: str
    scale: float
    node: int


class Transcription:
    """The program of one task on one grid.

    Variables: Y (nodes + 1, n) row by row, `layout` tells what is where; node 0 has no inputs.
    `lower`, `upper` bound the variables, `g_lower`, `g_upper` the rows; `meanings` names them.
    """

    def __init__(
        self, model: Model, task: Task, wishes: Sequence[Wish], reduction: Reduction, nodes: int
    ) -> None:
        self.model, self.task, self.wishes, self.nodes = model, task, wishes, nodes
        self.reduction = reduction
        self.layout = Layout(model, reduction, task.duration / nodes, task.step_variation)
        self.stage: Stage = build_stage(model, self.layout, reduction, task.cost, nodes)
        n = self.layout.size
        self.shape = (nodes + 1, n)
        self.lower = np.tile(self.layout.lower, (nodes + 1, 1))
        self.upper = np.tile(self.layout.upper, (nodes + 1, 1))
        self._rest_before_start()
        moments = self._apply_wishes()
        stage = self.stage
        index = np.arange((nodes + 1) * n).reshape(self.shape)
        pairs = np.hstack([index[:-1], index[1:]])
        both, p = ca.vertcat(stage.y0, stage.y), ca.vertcat(stage.eps, stage.weights)
        blocks = [Block(both, stage.g, stage.cost, pairs)]
        meanings = [m for k in range(1, nodes + 1) for r in stage.rows for m in _meanings(r, k)]
        g_bounds = [(r.lower, r.upper) for r in stage.rows for _ in r.labels] * nodes
        for rows, where in moments:
            blocks.append(Block(stage.y, rows.g, ca.SX(0), index[where]))
            meanings += [m for k in where for m in _meanings(rows, k)]
            g_bounds += [(rows.lower, rows.upper)] * len(where)
        self.meanings = meanings
        self.g_lower, self.g_upper = (np.array(b) for b in zip(*g_bounds, strict=True))
        self.problem = BlockProblem(blocks, index.size, p)

    def _rest_before_start(self) -> None:
        """Node 0 has no interval before it: its inputs and forces are dummies at zero."""
        for group in ("u", "lam"):
            part = self.layout.slices[group]
            self.lower[0, part] = self.upper[0, part] = 0.0
        part = self.layout.slices["h"]
        self.lower[0, part] = self.upper[0, part] = 1.0

    def _apply_wishes(self) -> list[tuple[Rows, list[int]]]:
        """Wishes on plain variables tighten their bounds; the others become rows at nodes."""
        full = {g: ca.densify(self.layout.full(self.stage.y, g)) for g in GROUPS if g != "h"}
        node = self.model.node
        symbols = {"q": node.q, "v": node.v, "s": node.s, "u": node.u, "lam": node.lam}
        rows: list[tuple[Rows, list[int]]] = []
        seen: set[tuple[object, ...]] = set()
        for wish in self.wishes:
            expression = quantity_expression(self.model, wish.quantity.name)
            g = ca.substitute(
                [expression], list(symbols.values()), [full[name] for name in symbols]
            )[0]
            g = ca.SX(ca.cse(ca.densify(g)))
            if ca.jacobian(g, self.stage.y).nnz() == 0:
                continue  # zero by symmetry
            where = list(range(self.nodes + 1)) if wish.at is None else [wish.node(self.nodes)]
            variable = as_variable(g, self.stage.y)
            if variable is not None:
                self._tighten(where, variable, wish)
            elif (key := (wish.at, str(g), wish.lower, wish.upper)) not in seen:
                seen.add(key)  # the mirrored leg's wish is the same row
                rows.append((_wish_row(g, wish), where))
        return rows

    def _tighten(self, where: list[int], variable: tuple[int, float, float], wish: Wish) -> None:
        index, factor, offset = variable
        ends = sorted(((wish.lower - offset) / factor, (wish.upper - offset) / factor))
        self.lower[where, index] = np.maximum(self.lower[where, index], ends[0])
        self.upper[where, index] = np.minimum(self.upper[where, index], ends[1])

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


def _wish_row(g: ca.SX, wish: Wish) -> Rows:
    scale = {"m": 0.1, "m.s-1": 1.0, "rad": 0.2}.get(wish.quantity.unit, 1.0)
    label = f"{wish.text}:{wish.quantity.name}"
    return Rows(
        "wish",
        g / scale,
        wish.lower / scale if wish.lower > -INF else -INF,
        wish.upper / scale if wish.upper < INF else INF,
        (label,),
        (wish.quantity.unit,),
        (scale,),
    )


def _meanings(rows: Rows, node: int) -> list[Meaning]:
    return [
        Meaning(rows.kind, label, unit, scale, node)
        for label, unit, scale in zip(rows.labels, rows.units, rows.scales, strict=True)
    ]
