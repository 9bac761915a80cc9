"""Valve edges of a table moved by ticks until an execution is near enough to what is wanted.

What an edge does to each error is seen by an execution with it moved by a tick. What several would
do together is the sum of these; the best sums are executed.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from math import comb

import numpy as np

from kemba.errors import KembaError
from kemba.events import PLANNED, read
from kemba.model import Model
from kemba.plant.certificate import played, rest_after
from kemba.plant.kernel.machine import Array
from kemba.trajectory import Trajectory

Edges = dict[str, list[int]]  # by valve column: ticks at which it opens, closes, opens ...
Group = list[tuple[str, int]]  # edges that move together: column, and which of its edges


# groups of edges that move by a tick at once: of a jump of 0.487 m no table with three was near
TOGETHER = 4
FAR = 2  # of which so many may move by two ticks
# moves of so many groups at most, else of fewer at once: they take 10 ms to compare, a third of an
# execution
MANY = 20_000


def edges_of(table: Trajectory) -> Edges:
    """The edges of a table's valves."""
    names = [name for name in table.names if "/valve/" in name]
    return {name: np.flatnonzero(np.diff(table[name], prepend=0.0)).tolist() for name in names}


def single_edges(table: Trajectory) -> list[Group]:
    """Every edge alone."""
    return [[(name, k)] for name, ticks in edges_of(table).items() for k in range(len(ticks))]


def shared_edges(table: Trajectory) -> list[Group]:
    """The same edge of all legs together, where their valves switch equally often."""
    edges, groups = edges_of(table), list[Group]()
    for side in ("extend", "retract"):
        legs = [name for name in edges if name.endswith(side)]
        counts = {len(edges[name]) for name in legs}
        if len(legs) > 1 and len(counts) == 1:
            groups += [[(name, k) for name in legs] for k in range(counts.pop())]
    return groups


def moves(count: int) -> Array:
    """Ticks (moves, count) by which some of `count` groups may move."""
    found = list[Array]()
    for groups in range(1, TOGETHER + 1):
        ticks = (-2, -1, 1, 2) if groups <= FAR else (-1, 1)
        if comb(count, groups) * len(ticks) ** groups > MANY:
            break
        where = np.array(list(combinations(range(count), groups)), dtype=int).reshape(-1, groups)
        by = np.array(list(product(ticks, repeat=groups)), dtype=int)
        block = np.zeros((len(where), len(by), count), dtype=int)
        places = np.broadcast_to(where[:, None], (len(where), len(by), groups))
        np.put_along_axis(block, places, np.broadcast_to(by, places.shape), axis=2)
        found.append(block.reshape(-1, count))
    return np.concatenate(found)


def with_moved(
    table: Trajectory, groups: Sequence[Group], ticks: Iterable[int]
) -> Trajectory | None:
    """The table with groups of edges moved by `ticks`; None where edges would meet."""
    edges = {name: list(own) for name, own in edges_of(table).items()}
    for group, by in zip(groups, ticks, strict=True):
        for name, k in group:
            edges[name][k] += int(by)
    for own in edges.values():
        if not all(0 <= tick < len(table) for tick in own) or not np.all(np.diff(own) > 0):
            return None
    columns = table.columns
    for name, own in edges.items():
        switched = np.isin(np.arange(len(table)), own)
        columns[f"{name} [{table.unit(name)}]"] = np.asarray(np.cumsum(switched) % 2.0)
    return Trajectory(table.time, columns, table.meta)


FALLEN = 1e3  # error of a robot that falls, in units of those: beyond any other
# predicted error at which a table is tried before the effects of all edges are known: below 1 by
# what predictions miss
SURE = 0.7
PRICE = 0.03  # predicted error that a tick counts as: of equal predictions fewer ticks are surer


@dataclass(frozen=True)
class ExecutedTable:
    """A table, the errors (k,) of its execution and the largest of them, in units of what is near
    enough."""

    table: Trajectory
    signed: Array
    error: float


@dataclass
class Roundings:
    """Executes tables as long as executions are left."""

    run: Callable[[Trajectory], ExecutedTable]
    left: int

    def best(self, table: Trajectory, last: float) -> ExecutedTable:
        """The table, or the best of those with edges up to `last` [s] some ticks away."""
        best, before = self.tried(table), np.inf
        while 1.0 < best.error < before and self.left > 0:
            before = best.error
            for edges in (shared_edges(table), single_edges(table)):
                ticks = edges_of(table)
                first = [min(table.time[ticks[name][k]] for name, k in group) for group in edges]
                groups = [group for group, at in zip(edges, first, strict=True) if at <= last]
                if groups:
                    best = self.around(best, groups)
        return best

    def tried(self, table: Trajectory) -> ExecutedTable:
        """A table, executed."""
        self.left -= 1
        return self.run(table)

    def around(self, start: ExecutedTable, groups: Sequence[Group]) -> ExecutedTable:
        """The best table that differs from `start` by ticks of some groups of edges."""
        best, effects = start, _Effects(len(groups), start.signed)
        unknown = list(range(len(groups)))
        while best.error > 1.0 and self.left > 0:
            ticks, alone = effects.promising(unknown, best.error), None
            if ticks is None:
                if not unknown:
                    break
                alone = unknown.pop(0)
                ticks = np.eye(len(groups), dtype=int)[alone]
            effects.done(ticks)
            table = with_moved(start.table, groups, ticks)
            found = self.tried(table) if table is not None else None
            if found is None or found.error >= FALLEN:
                continue
            same = found.signed.shape == start.signed.shape  # the same flights
            if same and start.error < FALLEN:
                effects.seen(ticks, found.signed, alone)
            if found.error < best.error:
                best = found
        return best


class _Effects:
    """What a tick of each group of edges does to the errors (n,) of `start`, as far as it was
    seen."""

    def __init__(self, count: int, start: Array) -> None:
        self.moves, self.slopes = moves(count), np.zeros((count, len(start)))
        self.open = np.ones(len(self.moves), dtype=bool)
        self.nearest, self.there = start, np.zeros(count, dtype=int)
        self.start = start

    def promising(self, unknown: Sequence[int], error: float) -> Array | None:
        """The ticks (groups,) that were not tried and are predicted to come nearest to the plan;
        None where that is not near enough: `SURE` as long as effects are `unknown`, then below
        `error`."""
        useless = np.abs(self.slopes).max(axis=1) <= PRICE
        possible = self.open & ~self.moves[:, useless].any(axis=1)
        away = self.nearest + (self.moves - self.there) @ self.slopes
        predicted = np.abs(away).max(axis=1) + PRICE * np.abs(self.moves).sum(axis=1)
        predicted[~possible] = np.inf
        best = int(predicted.argmin())
        near = SURE if unknown else error
        return np.asarray(self.moves[best]) if predicted[best] < near else None

    def done(self, ticks: Array) -> None:
        """These ticks (groups,) are not proposed again."""
        self.open &= (self.moves != ticks).any(axis=1)

    def seen(self, ticks: Array, signed: Array, alone: int | None) -> None:
        """Errors (n,) with these ticks (groups,); `alone`: of one group that moves alone for the
        first time."""
        if alone is not None:
            self.slopes[alone] = signed - self.start
        if np.abs(signed).max() < np.abs(self.nearest).max():
            self.nearest, self.there = signed, ticks


NEAR = (0.5e-3, 1e-3, 0.01)  # m, s, m; errors of apex, touchdown and end that need no search
EXECUTIONS = 24  # at most: edges on ticks of the plan cost as much


def retimed(model: Model, plan: Trajectory, table: Trajectory) -> Trajectory:
    """The table of a plan, or one with edges some ticks away whose execution on `model` is nearer
    to it. Edges after the last landing stay."""
    rest, (apex, touchdown, end) = rest_after(model, plan, table), NEAR

    def run(other: Trajectory) -> ExecutedTable:
        try:
            done = played(model, plan, other, rest)
        except KembaError:
            return ExecutedTable(other, np.full(2, np.inf), np.inf)
        signed = np.array([done.apex_error_m / apex, (done.touchdown_error_s or 0.0) / touchdown])
        error = float(max(np.abs(signed).max(), done.final_error_m / end))
        return ExecutedTable(other, signed, error + (0.0 if done.landed else FALLEN))

    course = read(plan, PLANNED, model.mechanism.weight, plan.time - plan.time[0])
    last = max((flight.end for flight in course.flights), default=np.inf)
    return Roundings(run, EXECUTIONS).best(table, last).table
