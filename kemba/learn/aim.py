"""A controller table whose execution, with what the model cannot explain added, meets the plan."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite

import numpy as np

from kemba.errors import KembaError
from kemba.learn.correction import Correction
from kemba.learn.flight import FlownJump, flight_of
from kemba.model import Model
from kemba.plant.execution.certificate import rest_after
from kemba.plant.execution.controller import execute, read_controller
from kemba.plant.execution.moved_edges import edges_of, neighbours
from kemba.plant.execution.retiming import RetimingSettings
from kemba.plotting.robot.machine import Machine
from kemba.settings import CHOSEN, Settings, setting
from kemba.trajectory import Trajectory


class AimSettings(Settings):
    """How a table is corrected: by moving valve edges, which sets push duration and landing."""

    apex = 1e-3  # apex error that needs no search [m]
    touchdown = 3e-3  # touchdown error that needs no search [s]
    pitch = 0.009  # pitch at touchdown, beyond the plan's, that a moved edge may make [rad]
    moved: int = setting(8, "ms", "by which an edge moves at most", CHOSEN, decides=True)
    executions = 60  # simulations at most


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
        flight = FlownJump(
            seen.apex + add.apex,
            seen.apex_time,
            seen.touchdown + add.touchdown,
            seen.pitch,
            seen.upright,
        )
        return flight, lands

    def corrected(self, table: Trajectory) -> Aimed:
        """The table with valve edges moved tick by tick as long as it is expected to come nearer
        to the plan."""
        settings = AimSettings.current()
        table = read_controller(table)
        rest, first = rest_after(self.model, self.plan, table), table
        wanted = flight_of(self.plan, self.machine)
        turn = self._turn(table, rest, wanted)
        best, must_land = self._miss(table, rest, wanted, turn)
        left = settings.executions
        while best > 1.0 and left > 0:
            nearest, choice = best, None
            for trial in neighbours(table):
                if left <= 0 or not _within(first, trial, settings.moved):
                    continue
                left -= 1
                miss, lands = self._miss(trial, rest, wanted, turn)
                if miss < nearest and (lands or not must_land):
                    nearest, choice = miss, trial
                    if miss < 0.7 * best:
                        break  # good progress: go on from here
            if choice is None:
                break
            best, table = nearest, choice
        return Aimed(table, self.expected(table, rest)[0], _moved(first, table))

    def _turn(self, table: Trajectory, rest: float, wanted: FlownJump) -> float:
        """The largest pitch [rad] beyond the plan's that a corrected table may touch down with:
        that of the table as it is, at least."""
        most = AimSettings.current().pitch
        try:
            turned = abs(self.expected(table, rest)[0].pitch - wanted.pitch)
        except KembaError:
            return most
        return max(turned, most) if isfinite(turned) else most

    def _miss(
        self, table: Trajectory, rest: float, wanted: FlownJump, turn: float
    ) -> tuple[float, bool]:
        """The root of squared errors in units of what needs no search, and whether it lands; a
        table that turns the body by more than `turn` [rad] counts as fallen."""
        settings, fallen = AimSettings.current(), RetimingSettings.current().fallen
        try:
            flight, lands = self.expected(table, rest)
        except KembaError:
            return inf, False
        errors = [(flight.apex - wanted.apex) / settings.apex]
        if isfinite(wanted.touchdown):
            errors.append((flight.touchdown - wanted.touchdown) / settings.touchdown)
            if abs(flight.pitch - wanted.pitch) > turn + 1e-9:
                return fallen, False
        miss = float(np.linalg.norm(errors))
        return (miss if isfinite(miss) else fallen), lands


def _moved(first: Trajectory, table: Trajectory) -> dict[str, list[int]]:
    """By how many ticks each edge moved, by column."""
    after = edges_of(table)
    return {
        name: [new - old for new, old in zip(after[name], ticks, strict=True)]
        for name, ticks in edges_of(first).items()
    }


def _within(first: Trajectory, table: Trajectory, most: int) -> bool:
    return all(abs(k) <= most for edges in _moved(first, table).values() for k in edges)
