"""A controller table whose execution, with what the model cannot explain added, meets the plan."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from math import inf, isfinite

import numpy as np

from kemba.errors import KembaError
from kemba.learn.correction import Correction
from kemba.learn.flight import FlownJump, flight_of
from kemba.model import Model
from kemba.plant.controller import execute, read_controller
from kemba.plant.replay import rest_after
from kemba.plant.retiming import (
    FALLEN,
    ExecutedTable,
    Group,
    Roundings,
    edges_of,
    shared_edges,
    single_edges,
)
from kemba.plotting.robot.machine import Machine
from kemba.settings import CHOSEN, Settings, setting
from kemba.trajectory import Trajectory


class AimSettings(Settings):
    """How a table is corrected: by moving valve edges, which sets push duration and landing."""

    apex = 0.5e-3  # apex error that needs no search [m]
    touchdown = 3e-3  # touchdown error that needs no search [s]
    pitch = 0.009  # pitch at touchdown, beyond the plan's, that a moved edge may make [rad]
    moved: int = setting(8, "ms", "by which an edge moves at most", CHOSEN, decides=True)
    executions = 60  # simulations at most


TURNED = 100.0  # error of a table that turns the body: more than of any other that lands


@dataclass(frozen=True)
class Aimed:
    """A table, what it is expected to do (simulation and correction together), and its edges'
    movement in ticks by column."""

    table: Trajectory
    expected: FlownJump
    moved: dict[str, list[int]]


@dataclass(frozen=True)
class Aim:
    """The plan on its model, and what executions do beyond that model."""

    model: Model
    machine: Machine
    plan: Trajectory
    correction: Correction

    def expected(self, table: Trajectory, rest: float) -> tuple[FlownJump, bool]:
        """The flight to expect of a table, and whether its simulation lands as planned.

        Raises KembaError where the table cannot be simulated.
        """
        done = execute(table, self.model, extra=rest)
        seen, add = flight_of(done.trajectory, self.machine), self.correction
        lands = done.against(self.model, self.plan).landed
        flight = FlownJump(seen.apex + add.apex, seen.touchdown + add.touchdown, seen.pitch)
        return flight, lands

    def corrected(self, table: Trajectory) -> Aimed:
        """The table with valve edges moved by ticks, as `retiming` chooses them, such that it is
        expected to come nearest to the plan."""
        first = read_controller(table)
        rest = rest_after(self.model, self.plan, first)
        wanted = flight_of(self.plan, self.machine)
        turn, must = self._limits(first, rest, wanted)
        run = partial(self._tried, first=first, rest=rest, wanted=wanted, turn=turn, must=must)
        search = Roundings(run, AimSettings.executions)
        best, before = search.tried(first), inf
        while 1.0 < best.error < before and search.left > 0:
            before = best.error
            for edges in (shared_edges(first), single_edges(first)):
                groups = [group for group in edges if not _begins(first, group) > wanted.touchdown]
                best = search.around(best, groups) if groups else best
        return Aimed(best.table, self.expected(best.table, rest)[0], _moved(first, best.table))

    def _limits(self, table: Trajectory, rest: float, wanted: FlownJump) -> tuple[float, bool]:
        """The largest pitch [rad] beyond the plan's that a corrected table may touch down with, at
        least that of the table as it is; and whether it must land, as that one does."""
        most = AimSettings.pitch
        try:
            flight, lands = self.expected(table, rest)
        except KembaError:
            return most, False
        turned = abs(flight.pitch - wanted.pitch)
        return max(turned, most) if isfinite(turned) else most, lands

    def _tried(
        self,
        table: Trajectory,
        first: Trajectory,
        rest: float,
        wanted: FlownJump,
        turn: float,
        must: bool,
    ) -> ExecutedTable:
        """A table with its expected errors of apex, touchdown and pitch there, in units of what
        needs no search, and of `turn` [rad]: one that turns the body more is never the best.

        One that falls where it `must` land, or has an edge far from where `first` has it, counts as
        fallen.
        """
        fallen = FALLEN
        try:
            flight, lands = self.expected(table, rest)
        except KembaError:
            return ExecutedTable(table, None, np.full(3, inf), inf)
        late, turned = flight.touchdown - wanted.touchdown, flight.pitch - wanted.pitch
        signed = np.array([flight.apex - wanted.apex, late, turned])
        signed /= [AimSettings.apex, AimSettings.touchdown, turn]
        if not isfinite(wanted.touchdown):
            signed[1:] = 0.0
        far = not _within(first, table, AimSettings.current().moved)
        if far or (must and not lands) or not np.isfinite(signed).all():
            return ExecutedTable(table, None, signed, fallen)
        turns = abs(signed[2]) > 1.0 + 1e-9
        error = float(np.abs(signed[:2]).max())
        return ExecutedTable(table, None, signed, error + (TURNED if turns else 0.0))


def _begins(table: Trajectory, group: Group) -> float:
    """When [s] the first edge of a group comes."""
    edges = edges_of(table)
    return float(min(table.time[edges[name][k]] for name, k in group))


def _moved(first: Trajectory, table: Trajectory) -> dict[str, list[int]]:
    """By how many ticks each edge moved, by column."""
    after = edges_of(table)
    return {
        name: [new - old for new, old in zip(after[name], ticks, strict=True)]
        for name, ticks in edges_of(first).items()
    }


def _within(first: Trajectory, table: Trajectory, most: int) -> bool:
    return all(abs(k) <= most for edges in _moved(first, table).values() for k in edges)
