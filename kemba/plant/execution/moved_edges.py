"""Valve edges of a controller's table, and tables in which some of them are ticks away."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import combinations, product
from math import comb

import numpy as np

from kemba.plant.stepping.arrays import Array
from kemba.trajectory import Trajectory

Edges = dict[str, list[int]]  # by valve column: ticks at which it opens, closes, opens ...
Group = list[tuple[str, int]]  # edges that move together: column, and which of its edges


# groups of edges that move by a tick at once: a jump of 0.487 m has no near table with three
# (benchmarks/retiming.py)
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
    if not all(_possible(own, len(table)) for own in edges.values()):
        return None
    columns: dict[str, Array] = {}
    for header, name in zip(table.headers, table.names, strict=True):
        columns[header] = table[name]
        if name in edges:
            columns[header] = np.zeros(len(table))
            for i, tick in enumerate(edges[name]):
                columns[header][tick:] = float(i % 2 == 0)
    return Trajectory(table.time, columns, table.meta)


def neighbours(table: Trajectory) -> Iterator[Trajectory]:
    """Tables with the same edge of all legs, or one edge, a tick earlier or later."""
    for group in (*shared_edges(table), *single_edges(table)):
        for tick in (-1, 1):
            moved = with_moved(table, [group], [tick])
            if moved is not None:
                yield moved


def _possible(ticks: list[int], rows: int) -> bool:
    return all(0 <= tick < rows for tick in ticks) and bool(np.all(np.diff(ticks) > 0))
