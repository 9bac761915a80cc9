"""The figures of a rig and of its effects, fitted to logs, with honest intervals.

Least squares on the residuals. What a model lacks is no white noise: it lasts. So the intervals
come from blocks of time ("sandwich"), of several lengths, as long as the motion or shorter; the
widest interval counts. They are those of one mounting of one machine.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.special import stdtrit

from kemba.config import dump_yaml
from kemba.effects.base import Effect
from kemba.errors import KembaError
from kemba.identify.evidence.linear import time_blocks
from kemba.identify.evidence.windows import rms
from kemba.identify.problem.problem import Array, Labels, Problem
from kemba.identify.rigs.problem import rig_problem
from kemba.identify.rigs.vessel import vessel_problem
from kemba.model.model import Model
from kemba.settings import BY_HAND, Settings, setting
from kemba.trajectory import Trajectory

# of what a rig brings along: which figures its logs can tell
TOLD = ("measured_chambers.gain", "drive_axis.J", "vessel_chamber.a")


class RigFitSettings(Settings):
    """How the figures of a rig are fitted."""

    blocks: tuple[int, ...] = setting(
        (12, 24, 48),
        "1",
        "numbers of blocks of time, at least, from which intervals come: the widest counts",
        "derived: errors that a repeated motion repeats cancel within a block as long as a repeat, "
        "so one length can be blind; with fewer than 12 blocks the spread itself is not known",
    )
    loose: float = setting(
        10.0, "1", "prior sigma of a factor that is fitted", "convention: as good as none"
    )
    step: float = setting(1e-4, "1", "step of finite differences of a factor", BY_HAND)
    flat: float = setting(
        1e-5, "1", "smallest pivot of a fit whose figures can be told apart", BY_HAND
    )


@dataclass(frozen=True)
class FittedFigure:
    """A fitted number with its 95 % interval, and the value that the model had."""

    name: str
    unit: str
    value: float
    low: float
    high: float
    given: float


@dataclass(frozen=True)
class RigFit:
    """What logs say of a rig; errors are RMS of the residual in units of the sensors' noise."""

    model: Model
    figures: tuple[FittedFigure, ...]
    error_before: float
    error_after: float
    rows: int

    def json(self) -> dict[str, Any]:
        """The figures as plain data."""
        listed = {
            f.name: {"value": f.value, "low": f.low, "high": f.high, "unit": f.unit}
            for f in self.figures
        }
        errors = {"error_before": self.error_before, "error_after": self.error_after}
        return {"figures": listed, **errors, "rows": self.rows}

    def effects(self) -> list[Effect]:
        """The model's effects with the fitted values."""
        found = []
        for effect in self.model.effects:
            own = {f.name.rsplit(".", 1)[1]: float(f"{f.value:.6g}") for f in self.figures
                   if f.name.rsplit(".", 1)[0] == effect.name}  # fmt: skip
            found.append(effect.bind(own))
        return found

    def write_model(self, path: Path, base: str) -> None:
        """Write a model YAML: `base` with the fitted values."""
        effects = [effect.listed() for effect in self.effects()]
        notes = "figures fitted by kemba-opt characterise"
        dump_yaml({"name": path.stem, "base": base, "effects": effects, "notes": notes}, path)


def fit_rig(logs: Sequence[Trajectory], model: Model) -> RigFit:
    """Fit every figure that the model lists, and those of the rig itself. Effects that are listed
    without a value start at their usual size. Raises KembaError where logs cannot tell them apart.
    """
    loose = RigFitSettings.current().loose
    started = Model(model.mechanism, map(_started, model.effects), model.supply, model.name)
    names = [
        name
        for name, (_, value) in started.parameters.items()
        if value and (name in TOLD or name.split(".")[0] not in {t.split(".")[0] for t in TOLD})
    ]
    make = vessel_problem if model.mechanism.rig == "vessel" else rig_problem
    if "measured_chambers.gain" not in names and model.mechanism.rig == "cylinder":
        names = ["measured_chambers.gain", *names]
    problem: Problem = make(logs, started, dict.fromkeys(names, loose))
    before: Problem = make(logs, model)
    values = {n: float(started.effect(n.rsplit(".", 1)[0]).value(n.rsplit(".", 1)[1]))
              for n in names}  # fmt: skip
    return _fit(problem, names, values, model, rms(before.residual({})))


def _started(effect: Effect) -> Effect:
    """The effect with its switch at the usual size where it stands at off."""
    sizes = effect.parameters()
    off = {n: v + sizes[n].size for n, v in effect.off.items() if effect.value(n) == v}
    return effect.bind(off) if off and effect.moves else effect


def _fit(
    problem: Problem, names: list[str], values: Mapping[str, float], model: Model, before: float
) -> RigFit:
    settings = RigFitSettings.current()
    starts = [n for n in problem.nuisance if n.startswith("start:")]
    free = [*names, *starts]
    centre = np.array([problem.nuisance[n][0] for n in free])
    width = np.array([1.0] * len(names) + [problem.nuisance[n][1] for n in starts])
    known = np.array([0.0] * len(names) + [1.0] * len(starts))

    def residual(x: Array) -> Array:
        theta = dict(zip(free, centre + width * x, strict=True))
        return np.concatenate([problem.residual(theta), known * x])

    found = least_squares(
        residual, np.zeros(len(free)), x_scale="jac", diff_step=settings.step, method="trf"
    )
    rows = len(problem.rows())
    j, r = found.jac[:rows], found.fun[:rows]
    scale = np.maximum(np.linalg.norm(j, axis=0), 1e-300)
    pivots = np.abs(np.diag(np.linalg.qr(j / scale, mode="r")))
    if pivots.min() < settings.flat:
        worst = free[int(np.argmin(pivots))]
        hint = "fix one of them: leave it out of the model, or log another motion"
        raise KembaError(worst, "cannot be told from the other figures by these logs", hint=hint)
    h = np.linalg.inv(j.T @ j + np.diag(known))
    divisions = [d for n in settings.blocks for d in _divisions(problem, n)]
    half_widths = np.max([_half_widths(d, j, r, h) for d in divisions], axis=0)
    figures = []
    for i, name in enumerate(names):
        factor, spread = 1.0 + found.x[i], half_widths[i]
        value, half = factor * values[name], abs(spread * values[name])
        effect, field = name.rsplit(".", 1)
        given = float(model.effect(effect).value(field))
        unit = _unit(model, name)
        figures.append(FittedFigure(name, unit, value, value - half, value + half, given))
    return RigFit(model, tuple(figures), before, rms(r), rows)


def _divisions(problem: Problem, wanted: int) -> list[Labels]:
    """Labels (n,) of the rows in so many blocks of time, and in so many stretches of the way, each
    with two directions: what a model lacks at one place it lacks in every repeat."""
    found = [time_blocks(problem, wanted=wanted)]
    if (way := problem.way()) is not None:
        place, forward = way
        edges = np.linspace(place.min(), place.max(), wanted + 1)[1:-1]
        found.append(2 * np.searchsorted(edges, place) + forward)
    return found


def _half_widths(labels: Labels, j: Array, r: Array, h: Array) -> Array:
    """Half the 95 % interval (k,) of each parameter, from the scatter of blocks of rows.

    `labels` (n,) of the blocks; `j` (n, k) and `r` (n,): slopes and residual of the fit; `h`
    (k, k): inverse of j'j.
    """
    pieces = np.stack([j[labels == b].T @ r[labels == b] for b in np.unique(labels)])
    freedom = max(len(pieces) - 1, 1)
    covariance = h @ (pieces.T @ pieces) @ h * len(pieces) / freedom
    return np.asarray(np.sqrt(np.diag(covariance)) * stdtrit(freedom, 0.975))


def _unit(model: Model, name: str) -> str:
    if name not in model.parameters:
        return "1"
    param = model.parameters[name][0]
    turns = model.mechanism.logged.get("axis/q") == "rad"
    return param.rotary if turns and param.rotary else param.unit
