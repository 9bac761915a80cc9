"""Characterising a cylinder from bench logs: eq. 4 to 7, Tables I and II, a model YAML."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kemba.config import Document, dump_yaml, parse
from kemba.effects import Effect
from kemba.effects.pneumatics.chamber import Chamber
from kemba.effects.pneumatics.damping import ModeDamping
from kemba.effects.pneumatics.tables import at_supply
from kemba.effects.pneumatics.valve import Valve
from kemba.errors import KembaError
from kemba.mechanism import Cylinder, rig_mechanism
from kemba.model import Model, ModelSpec
from kemba.plant.rig.estimate import Estimate, mean
from kemba.plant.rig.imposed import drive, followed
from kemba.plant.rig.rises import Rise, RiseTable, find_rises, rise_table
from kemba.plant.rig.strokes import StrokeLine, find_stroke, stroke_table
from kemba.plant.simulation.commands import Profile
from kemba.trajectory import Trajectory


@dataclass(frozen=True)
class Characteristics:
    """What bench logs say about a `cylinder`; `check` holds R2 and RMS [N] of the fitted model's
    force by log, for logs in which the rod and the valves both move."""

    cylinder: Cylinder
    rises: RiseTable | None
    lines: list[StrokeLine]
    plateaus: dict[tuple[str, float], Estimate]
    check: dict[str, tuple[float, float]]

    def effects(self) -> tuple[Chamber, ModeDamping, Valve]:
        """The fitted effects; where the logs give nothing the figures of the file are kept."""
        return fitted_effects(self.cylinder, self.rises, self.lines, self.plateaus)

    def write_model(self, path: str | Path, name: str = "characterised") -> None:
        """Write a model YAML: the planning model with the fitted chambers, damping and valves.

        Raises KembaError, and writes nothing, where a fitted value is none that a model can have.
        """
        effects = [_written(effect) for effect in self.effects()]
        notes = "chambers, damping and valves fitted by kemba-opt characterise"
        data = {"name": name, "base": "planning", "effects": effects, "notes": notes}
        parse(Document(data, f"the figures that these logs give {path}"), ModelSpec)
        dump_yaml(data, path)


def characterise(logs: dict[str, Trajectory], cylinder: Cylinder) -> Characteristics:
    """Fit eq. 4 to 7 to bench logs by name, of a cylinder of these dimensions. Raises KembaError
    when they hold nothing to fit."""
    for name, log in logs.items():
        _check_columns(name, log)
    rises = [rise for log in logs.values() for rise in find_rises(log, cylinder.stroke)]
    strokes = [s for s in map(find_stroke, logs.values()) if s is not None]
    if not rises and not strokes:
        raise KembaError(
            "characterise",
            "no log holds a locked rod with a switching valve, or a steady stroke",
            "bench logs as kemba-opt simulate writes them for configs/rigs were expected",
        )
    table = rise_table(rises) if rises else None
    lines, plateaus = stroke_table(strokes), _plateaus(rises)
    effects = fitted_effects(cylinder, table, lines, plateaus)
    check = {}
    for name, log in logs.items():
        if np.ptp(log["piston/x"]) > 1e-3 and _switches(log):
            check[name] = _compare(cylinder, effects, log)
    return Characteristics(cylinder, table, lines, plateaus, check)


def fitted_effects(
    cylinder: Cylinder,
    rises: RiseTable | None,
    lines: list[StrokeLine],
    plateaus: dict[tuple[str, float], Estimate],
) -> tuple[Chamber, ModeDamping, Valve]:
    """Chamber, damping and valve with the values of the tables."""
    chamber, damping = Chamber().of_cylinder(cylinder), ModeDamping().of_cylinder(cylinder)
    valve = Valve()
    force = {key: abs(e.value) for key, e in plateaus.items()}
    force |= {(line.mode, line.supply): abs(line.F_static.value) for line in lines}
    drag = {(line.mode, line.supply): max(line.c_d.value, 0.0) for line in lines}
    supplies = sorted({p for mode, p in force if mode in ("extend", "retract") and p > 0.0})
    if supplies:
        at = {f"F_{m}": _over(force, m, supplies, chamber, f"F_{m}")
              for m in ("extend", "retract")}  # fmt: skip
        chamber = chamber.model_copy(update={"pressures": tuple(supplies), **at})
    if drag:
        known = sorted({p for _, p in drag if p > 0.0}) or list(damping.value("pressures"))
        at = {f"c_{m}": _over(drag, m, known, damping, f"c_{m}")
              for m in ("extend", "retract", "both")}  # fmt: skip
        rest = drag.get(("none", 0.0), damping.c_none)
        damping = damping.model_copy(update={"pressures": tuple(known), **at, "c_none": rest})
    if rises:
        times = {name: tuple(e.value for e in getattr(rises, name)) for name in ("fill", "vent")}
        chamber = chamber.model_copy(update=times)
        dead = float(np.mean([e.value for e in rises.dead.values()]))
        valve = valve.model_copy(update={"dead_time": dead})
    return chamber, damping, valve


def _over(
    found: dict[tuple[str, float], float],
    mode: str,
    supplies: list[float],
    usual: Effect,
    table: str,
) -> tuple[float, ...]:
    """Values of a mode at the supplies, those of `table` of an effect where a test is missing."""
    return tuple(found.get((mode, p), float(at_supply(usual, table, p))) for p in supplies)


def _plateaus(rises: Iterable[Rise]) -> dict[tuple[str, float], Estimate]:
    """Steady force of each chamber at each supply, from the locked tests."""
    groups: dict[tuple[str, float], list[float]] = {}
    for rise in rises:
        groups.setdefault((rise.chamber, rise.supply), []).append(rise.plateau)
    return {key: mean(np.array(values)) for key, values in groups.items()}


def _compare(cylinder: Cylinder, effects: tuple[Any, ...], log: Trajectory) -> tuple[float, float]:
    return agreement(predict(cylinder, effects, log), log)


def agreement(predicted: Trajectory, log: Trajectory) -> tuple[float, float]:
    """R2 and RMS [N] of a predicted force on a log of the same times."""
    error = predicted["piston/F"] - log["piston/F"]
    spread = float(np.var(log["piston/F"]))
    return 1.0 - float(np.mean(error**2)) / spread, float(np.sqrt(np.mean(error**2)))


def predict(cylinder: Cylinder, effects: tuple[Any, ...], log: Trajectory) -> Trajectory:
    """What a `cylinder` with `effects` answers to the motion and the valves of a bench log."""
    supply = float(log.meta.get("supply", 0.7e6))
    model = Model(rig_mechanism(cylinder), effects, supply, "bench")
    valves = {name: Profile.of(log.time, log[name]) for name in ("valve/extend", "valve/retract")}
    return drive(model, followed(log), valves, log.time)


def _switches(log: Trajectory) -> bool:
    return any(np.ptp(log[f"valve/{chamber}"]) > 0.5 for chamber in ("extend", "retract"))


def _check_columns(name: str, log: Trajectory) -> None:
    for column in ("piston/x", "piston/F", "valve/extend", "valve/retract"):
        if column not in log:
            raise KembaError(name, f"has no column '{column}'", "a bench log was expected")


def _written(effect: Any) -> dict[str, Any]:
    data = effect.model_dump(exclude_none=True)
    return {k: list(v) if isinstance(v, tuple) else v for k, v in data.items()}
