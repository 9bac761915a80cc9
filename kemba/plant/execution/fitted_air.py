"""First-order air (eq. 4 to 7) fitted to what a finer simulation does with the same table.

Tables I and II are straight lines through measurements that are not straight: along one motion the
force of a held rod, the damping and the rise times are a few percent off. These figures, each times
one factor, are fitted by Gauss-Newton steps so that the executed table moves as on the plant.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kemba.effects import Effect
from kemba.errors import KembaError
from kemba.model import Model
from kemba.plant.execution.controller import execute
from kemba.plant.execution.replay import LandingSettings
from kemba.settings import CHOSEN, Settings, setting
from kemba.trajectory import Array, Trajectory

FIGURES = {
    "chamber": ("F_extend", "F_retract", "fill", "vent"),
    "mode_damping": ("c_extend", "c_retract", "c_none"),
}
FORCES = ("F_extend", "F_retract")


class AirFitSettings(Settings):
    """What a fit of the air looks at, and how far its figures may go."""

    height: float = setting(2e-3, "m", "error of the body's place that counts as one", CHOSEN)
    speed: float = setting(0.02, "m.s-1", "error of its speed that counts as one", CHOSEN)
    joint: float = setting(0.01, "rad", "error of a hip that counts as one", CHOSEN)
    piston: float = setting(1e-3, "m", "error of a piston that counts as one", CHOSEN)
    every: float = setting(0.01, "s", "between the times that are compared", CHOSEN)
    force: float = setting(
        0.1, "1", "1 sigma of the factor on a steady force, before the fit",
        "derived: forces of a held rod are 6 % below Table II on the shipped plant",
    )  # fmt: skip
    other: float = setting(0.2, "1", "the same for rise times and damping", CHOSEN)
    most: float = setting(3.0, "1", "sigmas by which a factor may differ from 1", CHOSEN)
    prior: float = setting(
        3.0, "1", "weight of the factors beside the motion: one sigma is an error of so many", CHOSEN
    )
    steps: int = setting(3, "1", "Gauss-Newton steps at most", CHOSEN)
    secant: float = setting(0.01, "1", "step of a factor for its slope", CHOSEN)


@dataclass(frozen=True)
class FittedAir:
    """Factors on the figures of the air by `effect.figure`, and the error of the simulated motion
    before and after, in units of `AirFitSettings`."""

    factors: Mapping[str, float]
    before: float
    after: float

    def changes(self, model: Model) -> dict[str, dict[str, Any]]:
        """The figures of `model` times these factors, as the `effects` of a task."""
        return {
            e.name: {f: getattr(e, f) for f in FIGURES[e.name]}
            for e in _scaled(model, np.array([*self.factors.values()]))
        }


def fitted_air(model: Model, table: Trajectory, plant: Trajectory) -> FittedAir | None:
    """The air of `model` for which the executed `table` moves as `plant`, the plant's execution of it.

    Compared are the body, the hips and the pistons, up to the first landing. None where the model
    has no first-order chambers. Raises KembaError where the table cannot be executed.
    """
    names = [effect.name for effect in model.effects]
    if any(name not in names for name in FIGURES):
        return None
    settings = AirFitSettings.current()
    motion = _Motion.of(model, table, plant)
    usual = np.array([settings.force if f in FORCES else settings.other for _, f in _listed()])
    factors = np.ones(len(usual))
    first = error = motion.error(factors)
    for _ in range(settings.steps):
        columns = [motion.error(factors + step) - error for step in settings.secant * np.eye(len(usual))]
        weights = settings.prior / usual
        A = np.vstack([np.column_stack(columns) / settings.secant, np.diag(weights)])
        b = np.concatenate([-error, weights * (1.0 - factors)])
        step = np.linalg.lstsq(A, b, rcond=None)[0]
        limits = settings.most * usual
        trial = np.clip(factors + step, 1.0 - limits, 1.0 + limits)
        new = motion.error(trial)
        if not _norm(new) < _norm(error):
            break
        factors, error = trial, new
    found = {f"{name}.{figure}": float(k) for (name, figure), k in zip(_listed(), factors, strict=True)}
    return FittedAir(found, _norm(first), _norm(error))


def _norm(error: Array) -> float:
    return float(np.sqrt(np.mean(error**2)))


def _listed() -> list[tuple[str, str]]:
    return [(name, figure) for name, figures in FIGURES.items() for figure in figures]


def _scaled(model: Model, factors: Array) -> list[Effect]:
    """The effects of the air with their figures times `factors`."""
    by_figure = dict(zip(_listed(), factors.tolist(), strict=True))
    found = []
    for name, figures in FIGURES.items():
        effect = model.effect(name)
        new = {f: _times(getattr(effect, f), by_figure[name, f]) for f in figures}
        found.append(effect.model_copy(update=new))
    return found


def _times(figure: Any, factor: float) -> Any:
    return tuple(factor * v for v in figure) if isinstance(figure, Sequence) else factor * figure


@dataclass(frozen=True)
class _Motion:
    """An execution to compare with: columns, what counts as one in each, and at which times."""

    model: Model
    table: Trajectory
    plant: Trajectory
    units: Mapping[str, float]
    times: Array

    @classmethod
    def of(cls, model: Model, table: Trajectory, plant: Trajectory) -> _Motion:
        s = AirFitSettings.current()
        units = {"body/x": s.height, "body/z": s.height, "body/vz": s.speed, "body/pitch": s.joint}
        for leg in model.mechanism.legs:
            units |= {f"{leg}/hip/q": s.joint, f"{leg}/piston/x": s.piston}
        own = execute(table, model).trajectory
        until = min(_lands(model, motion) for motion in (own, plant))
        return cls(model, table, plant, units, np.arange(s.every, until, s.every))

    def error(self, factors: Array) -> Array:
        """Simulated minus the plant's, in the units of each column (columns x times)."""
        model = self.model.with_effects(_scaled(self.model, factors))
        motion = execute(self.table, model).trajectory
        rows = [
            (np.interp(self.times, motion.time, motion[name])
            - np.interp(self.times, self.plant.time, self.plant[name])) / unit
            for name, unit in self.units.items()
        ]
        return np.concatenate(rows)


def _lands(model: Model, motion: Trajectory) -> float:
    """When [s] a foot comes down after the apex; the end of a motion in which none does."""
    low = LandingSettings.current().on_ground
    feet = np.min([motion[f"{leg}/foot/z"] for leg in model.mechanism.legs], axis=0)
    apex = int(np.argmax(motion["body/z"]))
    comes = np.flatnonzero((feet[:-1] > low) & (feet[1:] <= low) & (np.arange(len(feet) - 1) >= apex))
    return float(motion.time[comes[0]] if len(comes) else motion.time[-1])
