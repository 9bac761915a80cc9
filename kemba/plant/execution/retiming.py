"""Valve edges of a controller table moved by ticks, where its own execution shows that this helps.

Rounding an edge to a tick of 1 ms can move the apex of a light robot by a centimetre. Which
rounding is best depends on the whole motion, so the table is simulated with other roundings.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from kemba.errors import KembaError
from kemba.model import Model
from kemba.plant.execution.certificate import rest_after
from kemba.plant.execution.controller import execute
from kemba.plant.execution.replay import ends_standing
from kemba.plant.stepping.arrays import Array
from kemba.settings import CHOSEN, Settings, setting
from kemba.trajectory import Trajectory

Edges = dict[str, list[int]]  # by valve column: ticks at which it opens, closes, opens ...


class RetimingSettings(Settings):
    """How long other roundings of a table are tried, and how near is near enough."""

    apex: float = setting(0.5e-3, "m", "apex error that needs no search", CHOSEN)
    touchdown: float = setting(1e-3, "s", "touchdown error that needs no search", "derived: a tick")
    final: float = setting(0.01, "m", "error of the end that needs no search", CHOSEN)
    fallen: float = setting(
        1e3, "1", "error of a robot that falls, in units of those", "convention: beyond any other"
    )
    executions: int = setting(
        24, "1", "simulations at most", "derived: edges on ticks of the plan cost as much; tried "
        "beside 80 at nine heights (docs/solving.md)",
    )  # fmt: skip


def retimed(model: Model, plan: Trajectory, table: Trajectory) -> Trajectory:
    """The table, or a neighbour of it whose execution on `model` comes nearer to the plan.

    Edges move by single ticks, one alone or the same edge of all legs together, as long as the
    largest error falls, in units of `RetimingSettings`.
    """
    error = partial(_error, model, plan, extra=rest_after(model, plan, table))
    best, executions = error(table), iter(range(RetimingSettings.current().executions))
    while best > 1.0:
        trials = ((error(t), t) for _, t in zip(executions, neighbours(table), strict=False))
        nearer = next((trial for trial in trials if trial[0] < best), None)
        if nearer is None:
            break
        best, table = nearer
    return table


def _error(model: Model, plan: Trajectory, table: Trajectory, extra: float) -> float:
    """Largest error of the executed table in units of what needs no search."""
    limits = RetimingSettings.current()
    try:
        facts = execute(table, model, extra=extra).against(model, plan)
    except KembaError:
        return np.inf
    errors = [facts.apex_error_m / limits.apex, facts.final_error_m / limits.final]
    errors.append((facts.touchdown_error_s or 0.0) / limits.touchdown)
    falls = not facts.landed and bool(ends_standing(model, plan))
    return float(np.max(np.abs(errors))) + (limits.fallen if falls else 0.0)


def neighbours(table: Trajectory) -> Iterator[Trajectory]:
    """Tables with one edge, or the same edge of all legs, a tick earlier or later."""
    edges = _edges(table)
    groups = [[(name, k)] for name, ticks in edges.items() for k in range(len(ticks))]
    for side in ("extend", "retract"):
        legs = [name for name in edges if name.endswith(side)]
        counts = {len(edges[name]) for name in legs}
        if len(legs) > 1 and len(counts) == 1:
            groups[:0] = [[(name, k) for name in legs] for k in range(counts.pop())]
    for group in groups:
        for shift in (-1, 1):
            moved = {name: list(ticks) for name, ticks in edges.items()}
            for name, k in group:
                moved[name][k] += shift
            if all(_possible(ticks, len(table)) for ticks in moved.values()):
                yield _with(table, moved)


def _edges(table: Trajectory) -> Edges:
    names = [name for name in table.names if "/valve/" in name]
    return {name: np.flatnonzero(np.diff(table[name], prepend=0.0)).tolist() for name in names}


def _possible(ticks: list[int], rows: int) -> bool:
    return all(0 <= tick < rows for tick in ticks) and bool(np.all(np.diff(ticks) > 0))


def _with(table: Trajectory, edges: Edges) -> Trajectory:
    """The table with these edges of its valves; columns keep their order."""
    columns: dict[str, Array] = {}
    for header, name in zip(table.headers, table.names, strict=True):
        columns[header] = table[name]
        if name in edges:
            columns[header] = np.zeros(len(table))
            for i, tick in enumerate(edges[name]):
                columns[header][tick:] = float(i % 2 == 0)
    return Trajectory(table.time, columns, table.meta)
