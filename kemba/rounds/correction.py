"""The next plan corrected by what the last execution missed: its aim, its valve times."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial
from math import inf, isfinite
from pathlib import Path
from typing import Any

import numpy as np

from kemba.config import dump_yaml
from kemba.errors import KembaError
from kemba.model import Model
from kemba.plant.certificate import rest_after
from kemba.plant.controller import execute, read_controller
from kemba.plant.retiming import FALLEN, ExecutedTable, Roundings, edges_of
from kemba.plotting.source import Machine
from kemba.trajectory import Trajectory


@dataclass(frozen=True)
class FlownJump:
    """Apex [m]; the touchdown after it [s] and the pitch [rad] there, NaN where no foot comes down.
    The clock is that of the motion."""

    apex: float
    touchdown: float
    pitch: float


def flight_of(motion: Trajectory, machine: Machine) -> FlownJump:
    """The highest flight of a motion with body/z, body/pitch and every leg's hip and piston (or
    knee). Logs and simulations are read alike, so that their differences are those of the robot."""
    course = machine.measured(motion)
    if not np.isfinite(course.landing):
        return FlownJump(course.top[1], np.nan, np.nan)
    pitch = motion.get("body/pitch", np.zeros(len(motion)))
    return FlownJump(
        course.top[1], course.landing, float(np.interp(course.landing, motion.time, pitch))
    )


QUANTITIES = ("apex", "touchdown")
NOTE = "what executions did beyond the learnt model; it moves valve edges and is no physics"


class CorrectionSettings:
    """Bounds of the correction, and the scatter that is expected of executions."""

    apex = 0.05  # largest apex error that is corrected [m]
    touchdown = 0.02  # largest error of touchdown that is corrected [s]
    # 1 sigma of the apex between executions, where fewer than three are known [m]: valves that
    # scatter by 0.1 ms, on the shipped plant
    apex_scatter = 3e-3
    touchdown_scatter = 2e-3  # the same for touchdown [s]


@dataclass(frozen=True)
class Correction:
    """Executed minus simulated on the learnt model: apex [m], touchdown [s]. The body's pitch is
    left alone.

    `logs`: from how many executions; `limited`: what was larger than its bound.
    """

    apex: float = 0.0
    touchdown: float = 0.0
    logs: int = 0
    limited: tuple[str, ...] = ()


def correction_from(executed: Sequence[FlownJump], simulated: FlownJump) -> Correction:
    """The mean error of the executions, drawn towards zero by how much it may be chance.

    An error e with standard error s counts by e^2 / (e^2 + s^2), so that scatter is not chased.
    """
    settings, found, limited = CorrectionSettings, {}, []
    for name in QUANTITIES:
        errors = np.array([getattr(f, name) - getattr(simulated, name) for f in executed])
        errors = errors[np.isfinite(errors)]
        if not len(errors):
            found[name] = 0.0
            continue
        mean, usual = float(errors.mean()), float(getattr(settings, f"{name}_scatter"))
        scatter = float(errors.std(ddof=1)) if len(errors) > 2 else usual
        chance = scatter**2 / len(errors)
        counted = mean * mean**2 / (mean**2 + chance) if mean else 0.0
        bound = float(getattr(settings, name))
        if abs(counted) > bound:
            limited.append(name)
        found[name] = float(np.clip(counted, -bound, bound))
    return Correction(**found, logs=len(executed), limited=tuple(limited))


def scatter_of(executed: Sequence[FlownJump]) -> float:
    """1 sigma [m] of the apex between executions: what is usual, counted as one of them, and what
    they show."""
    usual = CorrectionSettings.apex_scatter
    apex = np.array([f.apex for f in executed])
    squares = float(np.sum((apex - apex.mean()) ** 2)) if len(apex) > 1 else 0.0
    return float(np.sqrt((usual**2 + squares) / max(len(apex), 1)))


def write_correction(
    path: Path, correction: Correction, moved: dict[str, list[int]], reached: dict[str, Any]
) -> None:
    """The correction's own file; `moved`: ticks [ms] by which valve edges moved, by column."""
    told = {"note": NOTE, "unexplained": asdict(correction)}
    units = {"apex": "m", "touchdown": "s"}
    dump_yaml({**told, "units": units, "edges_moved_ms": moved, **reached}, path)


class AimSettings:
    """How a table is corrected: by moving valve edges, which sets push duration and landing."""

    apex = 0.5e-3  # apex error that needs no search [m]
    touchdown = 3e-3  # touchdown error that needs no search [s]
    pitch = 0.009  # pitch at touchdown, beyond the plan's, that a moved edge may make [rad]
    moved = 8  # by which an edge moves at most [ms]
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
        """The flight to expect of a table, and whether its simulation lands as planned. Raises
        KembaError where the table cannot be simulated."""
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
        best = Roundings(run, AimSettings.executions).best(first, wanted.touchdown)
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
        try:
            flight, lands = self.expected(table, rest)
        except KembaError:
            return ExecutedTable(table, np.full(3, inf), inf)
        late, turned = flight.touchdown - wanted.touchdown, flight.pitch - wanted.pitch
        signed = np.array([flight.apex - wanted.apex, late, turned])
        signed /= [AimSettings.apex, AimSettings.touchdown, turn]
        if not isfinite(wanted.touchdown):
            signed[1:] = 0.0
        moved = _moved(first, table).values()
        far = any(abs(k) > AimSettings.moved for ticks in moved for k in ticks)
        if far or (must and not lands) or not np.isfinite(signed).all():
            return ExecutedTable(table, signed, FALLEN)
        turns = abs(signed[2]) > 1.0 + 1e-9
        error = float(np.abs(signed[:2]).max())
        return ExecutedTable(table, signed, error + (TURNED if turns else 0.0))


def _moved(first: Trajectory, table: Trajectory) -> dict[str, list[int]]:
    """By how many ticks each edge moved, by column."""
    after = edges_of(table)
    return {
        name: [new - old for new, old in zip(after[name], ticks, strict=True)]
        for name, ticks in edges_of(first).items()
    }
