"""The figures of a rig and of its effects, fitted to logs, with honest intervals.

Least squares on the residuals within what a model can have; intervals from blocks of rows, spanning
what runs say that disagree (`written.scatter`). They are those of one mounting of one machine.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from kemba.config import dump_yaml
from kemba.effects.base import Effect
from kemba.errors import KembaError
from kemba.identify.infer.joint import RIG_FIGURES, conflicts_between_runs, divisions, half_widths
from kemba.identify.infer.windows import rms
from kemba.identify.logs.reading import excerpts, read_logs
from kemba.identify.problem.problem import Array, Problem
from kemba.identify.workflow import make_problem, model_of, posed
from kemba.logs import log_files
from kemba.model.model import Model
from kemba.trajectory import Trajectory

LOOSE = 10.0  # prior sigma of a factor that is fitted: as good as none
STEP = 1e-4  # step of finite differences of a factor
FLAT = 1e-5  # smallest pivot of a fit whose figures can be told apart


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
    apart: tuple[str, ...] = ()  # figures on which runs disagree: their intervals span them

    def json(self) -> dict[str, Any]:
        """The figures as plain data."""
        listed = {
            f.name: {"value": f.value, "low": f.low, "high": f.high, "unit": f.unit}
            for f in self.figures
        }
        errors = {"error_before": self.error_before, "error_after": self.error_after}
        return {"figures": listed, **errors, "rows": self.rows, "apart": list(self.apart)}

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


def _fit_rig(logs: Sequence[Trajectory], model: Model, given: Problem) -> RigFit:
    """Fit all figures that the model lists and that show; `given`: the problem before. Raises
    KembaError."""
    effects = []
    for effect in model.effects:  # a switch that stands at off starts at its usual size
        sizes = effect.parameters()
        off = {n: v + sizes[n].size for n, v in effect.off.items() if effect.value(n) == v}
        effects.append(effect.bind(off) if off and effect.moves else effect)
    started = Model(model.mechanism, effects, model.supply, model.name)
    brought = {name.split(".")[0] for name in RIG_FIGURES}  # of these only the figures named
    listed = [name for name, (_, value) in started.parameters.items() if value]
    names = [n for n in listed if n in RIG_FIGURES or n.split(".")[0] not in brought]
    if "measured_chambers.gain" not in names and model.mechanism.rig == "cylinder":
        names = ["measured_chambers.gain", *names]
    problem = make_problem(logs, started, dict.fromkeys(names, LOOSE))
    # a slope of 1: a shape is known to its own size at 1 sigma
    seen = np.linalg.norm(problem.jacobian({}, names), axis=0) > 1.0
    shapes = {
        f"{e.name}.{n}" for e in started.effects if e.off for n in e.parameters().keys() - e.off
    }
    names = [n for n, shows in zip(names, seen, strict=True) if shows or n not in shapes]
    values = {n: float(started.effect(n.rsplit(".", 1)[0]).value(n.rsplit(".", 1)[1]))
              for n in names}  # fmt: skip
    return _fit(problem, names, values, model, rms(given.residual({})))


def _fit(
    problem: Problem, names: list[str], values: Mapping[str, float], model: Model, before: float
) -> RigFit:
    starts = [n for n in problem.nuisance if n.startswith("start:")]
    free = [*names, *starts]
    centre = np.array([problem.nuisance[n][0] for n in free])
    width = np.array([1.0] * len(names) + [problem.nuisance[n][1] for n in starts])
    known = np.array([0.0] * len(names) + [1.0] * len(starts))

    def residual(x: Array) -> Array:
        theta = dict(zip(free, centre + width * x, strict=True))
        return np.concatenate([problem.residual(theta), known * x])

    lower, upper = _bounds(model, names, values, len(starts))
    start, bounds = np.zeros(len(free)), (lower, upper)
    found = least_squares(residual, start, bounds=bounds, x_scale="jac", diff_step=STEP)
    rows = len(problem.rows())
    j, r = found.jac[:rows], found.fun[:rows]
    scale = np.maximum(np.linalg.norm(j, axis=0), 1e-300)
    pivots = np.abs(np.diag(np.linalg.qr(j / scale, mode="r")))
    if pivots.min() < FLAT:
        worst = free[int(np.argmin(pivots))]
        hint = "fix one of them: leave it out of the model, or log another motion"
        raise KembaError(worst, "cannot be told from the other figures by these logs", hint=hint)
    h = np.linalg.inv(j.T @ j + np.diag(known))
    widths = np.max([half_widths(d, j, r, h) for d in divisions(problem)], axis=0)
    runs = dict(conflicts_between_runs(problem, j[:, : len(names)], r))
    figures = []
    for i, name in enumerate(names):
        ends = [-widths[i], widths[i], *runs.get(i, ())]
        value = (1.0 + found.x[i]) * values[name]
        low, high = (value + abs(values[name]) * end for end in (min(ends), max(ends)))
        effect, field = name.rsplit(".", 1)
        given = float(model.effect(effect).value(field))
        unit = _unit(model, name)
        figures.append(FittedFigure(name, unit, value, low, high, given))
    apart = tuple(names[i] for i in runs)
    return RigFit(model, tuple(figures), before, rms(r), rows, apart)


def _bounds(
    model: Model, names: list[str], values: Mapping[str, float], starts: int
) -> tuple[Array, Array]:
    """Smallest and largest change (k,) of factors such that a model can have the figures."""
    ends = []
    for name in names:
        declared = model.parameters[name][0] if name in model.parameters else None
        span = (declared.lower, declared.upper) if declared else (-np.inf, np.inf)
        ends.append(sorted(end / values[name] - 1.0 for end in span))
    ends += [[-np.inf, np.inf]] * starts
    lower, upper = np.array(ends).T
    return lower, upper


def _unit(model: Model, name: str) -> str:
    if name not in model.parameters:
        return "1"
    param = model.parameters[name][0]
    turns = model.mechanism.logged.get("axis/q") == "rad"
    return param.rotary if turns and param.rotary else param.unit


def characterise_logs(
    logs: Sequence[str | Path], model: str, column_map: str | Path | None = None
) -> RigFit:
    """The figures of the rig of `model`, and of its effects, from logs (or folders of them).

    Raises KembaError; BadData where the logs cannot be right, as `compare` says it.
    """
    read = read_logs(log_files(logs), column_map)
    given, _ = posed(read, model)
    return _fit_rig(excerpts(read)[0], model_of(read, model), given)
