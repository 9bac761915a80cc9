"""First-order air (eq. 4 to 7) fitted to what a finer simulation does with the same table.

Tables I and II are straight lines through measurements that are not straight: along one motion the
force of a held rod, the damping and the rise times are a few percent off. These figures, each times
one factor, are fitted by Gauss-Newton steps so that the executed table moves as on the plant.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kemba.effects import Effect
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
        3.0,
        "1",
        "weight of the factors: one sigma counts as an error of so many",
        CHOSEN,
    )
    steps: int = setting(6, "1", "Gauss-Newton steps at most", CHOSEN)
    damping: tuple[float, ...] = setting(
        (0.0, 10.0, 100.0), "1", "weights of a step that are tried: one sigma of a factor counts "
        "as an error of so many", CHOSEN,
    )  # fmt: skip
    falls: float = setting(
        0.9, "1", "times the error that a step must leave at most to be worth another", CHOSEN
    )
    told: float = setting(5e-3, "1", "smaller changes are not told", "convention: half a percent")
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
            e.name: {figure: _rounded(getattr(e, figure)) for figure in FIGURES[e.name]}
            for e in _scaled(model, np.array([*self.factors.values()]))
        }

    def towards(self, other: FittedAir | None, share: float) -> FittedAir:
        """Factors at `share` of the way to those of another fit, or to 1; errors are those of this
        one."""
        ends = other.factors if other else dict.fromkeys(self.factors, 1.0)
        new = {name: own + share * (ends[name] - own) for name, own in self.factors.items()}
        return FittedAir(new, self.before, self.after)

    def summary(self) -> dict[str, Any]:
        """The figures of the certificate."""
        return {"factors": dict(self.factors), "before": self.before, "after": self.after}

    @property
    def sentence(self) -> str:
        """What was changed, in words."""
        told = [
            f"{name.partition('.')[2]} {100 * (factor - 1):+.0f} %"
            for name, factor in self.factors.items()
            if abs(factor - 1) >= AirFitSettings.current().told
        ]
        figures = ", ".join(told) or "hardly changed"
        return f"the air of its model is fitted to the simulated robot ({figures})"


def _rounded(figure: Any) -> Any:
    """A figure with five digits, so that the task file can be read."""
    if isinstance(figure, Sequence):
        return [_rounded(value) for value in figure]
    return float(f"{figure:.5g}")


def fitted_air(
    model: Model, table: Trajectory, plant: Trajectory, start: FittedAir | None = None
) -> FittedAir | None:
    """The air of `model` for which the executed `table` moves as `plant`, its execution there.

    Compared are the body, the hips and the pistons, up to the first landing. `start`: an earlier
    fit to begin from. None where the model has no first-order chambers. Raises KembaError where the
    table cannot be executed.
    """
    listed = [effect.name for effect in model.effects]
    if any(name not in listed for name in FIGURES):
        return None
    settings = AirFitSettings.current()
    usual = np.array([settings.force if f in FORCES else settings.other for _, f in _listed()])
    factors = np.array([*start.factors.values()]) if start else np.ones(len(usual))
    motion = _Motion.of(model, table, plant, factors)
    first = error = motion.error(factors)
    for _ in range(settings.steps):
        limits = settings.most * usual
        steps = motion.steps(factors, error, usual)
        near = (np.clip(factors + step, 1 - limits, 1 + limits) for step in steps)
        tried = ((k, motion.error(k)) for k in near)
        nearer = next(((k, e) for k, e in tried if _norm(e) < settings.falls * _norm(error)), None)
        if nearer is None:
            break
        factors, error = nearer
    names = [f"{name}.{figure}" for name, figure in _listed()]
    found = dict(zip(names, factors.tolist(), strict=True))
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
    def of(cls, model: Model, table: Trajectory, plant: Trajectory, factors: Array) -> _Motion:
        s = AirFitSettings.current()
        units = {"body/x": s.height, "body/z": s.height, "body/vz": s.speed, "body/pitch": s.joint}
        for leg in model.mechanism.legs:
            units |= {f"{leg}/hip/q": s.joint, f"{leg}/piston/x": s.piston}
        own = execute(table, model.with_effects(_scaled(model, factors))).trajectory
        until = min(_lands(model, motion) for motion in (own, plant))
        return cls(model, table, plant, units, np.arange(s.every, until, s.every))

    def steps(self, factors: Array, error: Array, usual: Array) -> Iterator[Array]:
        """Gauss-Newton steps of the factors (n,), drawn towards 1 by how far they `usual`ly are
        from it, shorter and shorter; `error` is that of the factors."""
        settings = AirFitSettings.current()
        moved = factors + settings.secant * np.eye(len(factors))
        slopes = [(self.error(each) - error) / settings.secant for each in moved]
        weights = settings.prior / usual
        b = np.concatenate([-error, weights * (1.0 - factors), np.zeros(len(factors))])
        for damping in settings.damping:
            A = np.vstack([np.column_stack(slopes), np.diag(weights), np.diag(damping / usual)])
            yield np.linalg.lstsq(A, b, rcond=None)[0]

    def error(self, factors: Array) -> Array:
        """Simulated minus the plant's, in the units of each column (columns x times)."""
        model = self.model.with_effects(_scaled(self.model, factors))
        motion = execute(self.table, model).trajectory
        rows = [
            (
                np.interp(self.times, motion.time, motion[name])
                - np.interp(self.times, self.plant.time, self.plant[name])
            )
            / unit
            for name, unit in self.units.items()
        ]
        return np.concatenate(rows)


def _lands(model: Model, motion: Trajectory) -> float:
    """When [s] a foot comes down after the apex; the end of a motion in which none does."""
    low = LandingSettings.current().on_ground
    feet = np.min([motion[f"{leg}/foot/z"] for leg in model.mechanism.legs], axis=0)
    apex = int(np.argmax(motion["body/z"]))
    down = np.flatnonzero((feet[:-1] > low) & (feet[1:] <= low))
    comes = down[down >= apex]
    return float(motion.time[comes[0]] if len(comes) else motion.time[-1])
