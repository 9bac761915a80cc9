"""The contract between logs and search: a set of logs under one model, as whitened residuals.

A bench log and a robot log differ in everything but this contract. A subclass of `Problem` owns
the prediction and the noise. Ranking, search, doubts and the answer work on any `Problem`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from types import MappingProxyType

import numpy as np
from typing_extensions import Self

from kemba.identify.problem.types import (
    Array,
    Candidate,
    Changes,
    Flags,
    ForceChannel,
    Leftover,
    MissingForce,
    OperatingPoint,
    Parameter,
    Rows,
    Theta,
)
from kemba.model.model import Model

NUISANCE = 0.5  # step of a nominal figure, in prior sigmas
PARAMETER = 0.05  # step of a parameter that is on, as a share of its size or value
ABSURD = 1e5  # residual in sigmas at which nothing can be predicted: beyond data


def bounded(residual: Array, absurd: float) -> Array:
    """Residuals (n,) within `absurd` sigmas; those that are no numbers are as large as that."""
    return np.asarray(np.clip(np.nan_to_num(residual, nan=absurd), -absurd, absurd))


def mean_slope(base: Array, there: Sequence[Array], steps: Sequence[float]) -> Array:
    """Mean slope (n,) of residuals `base` (n,) over finite `steps` that lead to the residuals
    `there`; zero where every step leads to where nothing can be predicted: a rod that is driven
    through its cylinder's end leaves no volume to the air."""
    known = [i for i, r in enumerate(there) if np.all(np.abs(r) < ABSURD)]
    if not known:
        return np.zeros_like(base)
    return np.asarray(np.mean([(there[i] - base) / steps[i] for i in known], axis=0))


class Problem(ABC):
    """One set of logs under one model.

    The prediction. `residual(theta)` is (predicted - measured) / noise, one number per row,
    whitened: about N(0, 1) and independent from row to row if the model at `theta` is right. Rows
    stand run by run in the order of `runs`, then channel by channel, then in time; `rows()`
    describes them in the same order. Physical values are in SI units, as `Parameter.unit` says.
    The rows do not depend on theta.

    A problem does not change. What learns something (`recolour`, `relinearise`) returns a new
    problem; the old one stays as it was.

    `runs`: names of the runs. `candidates`: effects that may be missing, by name. `nuisance`:
    nominal value and prior sigma of every figure that is never exactly known, by name; it is always
    free within its prior. `window`: number of successive rows over which errors are summed before
    they are judged: 1 where each row is a prediction over a long time, more where rows are one-step
    errors.

    Everything below `rows` is a capability with a default: a problem that lacks it inherits "none".
    """

    runs: tuple[str, ...]
    candidates: dict[str, Candidate]
    nuisance: dict[str, tuple[float, float]]
    window: int = 1
    model: Model  # of the logs; what has none has no file either

    @abstractmethod
    def residual(self, theta: Theta) -> Array:
        """Whitened residuals (n,) of all runs."""

    def residuals(self, thetas: Sequence[Theta]) -> Array:
        """Whitened residuals (n, c) of all runs at each of c thetas; quicker where a problem can
        share work between them."""
        return np.stack([self.residual(theta) for theta in thetas], axis=1)

    @abstractmethod
    def rows(self) -> Rows:
        """What each row (n,) of `residual` is."""

    # Slopes

    def jacobian(self, theta: Theta, names: Iterable[str]) -> Array:
        """d residual / d names (n, k), per unit of each parameter.

        A switch that is off has no useful derivative; it gets a secant (`_secant_step`). The
        default takes finite differences with steps of physical size for all parameters; a column is
        zero where every step leads to no prediction at all.
        """
        base = self.residual(theta)
        columns = []
        for name in names:
            steps = list(self.steps(theta, name))
            slopes = [(self.residual({**theta, **step}) - base) / h for step, h in steps]
            known = [slope for slope in slopes if np.isfinite(slope).all()]
            columns.append(np.mean(known, axis=0) if known else np.zeros_like(base))
        return np.stack(columns, axis=1) if columns else np.empty((len(base), 0))

    def steps(self, theta: Theta, name: str) -> Iterable[tuple[dict[str, float], float]]:
        """Steps for a finite difference along `name`: changed entries of theta, and how far they
        go [the parameter's unit]. Two of them where both signs are possible."""
        if name in self.nuisance:
            nominal, sigma = self.nuisance[name]
            h, value = NUISANCE * sigma, theta.get(name, nominal)
            h = -h if value + h > self.limits(name)[1] else h
            yield {name: value + h}, h
            return
        candidate = self.candidates[name.rsplit(".", 1)[0]]
        parameter = candidate.keys()[name]
        if name == candidate.key and theta.get(name, parameter.off) == parameter.off:
            shapes = {k: theta.get(k, p.typical) for k, p in candidate.keys().items() if k != name}
            h = self._secant_step(parameter)
            for sign in (1.0, -1.0) if parameter.signed else (1.0,):
                yield {**shapes, name: parameter.off + sign * h}, sign * h
            return
        value = theta[name]
        h = PARAMETER * (parameter.size if name == candidate.key else abs(value))
        h = -h if value + h > parameter.upper else h
        yield {name: value + h}, h

    def _secant_step(self, switch: Parameter) -> float:
        """Step of a switch that is off: its size; a time by one row, which moves an edge."""
        if switch.unit != "s":
            return switch.size
        least = max(switch.lower - switch.off, 0.0)  # of a time constant, which is never zero
        return max(min(switch.size, self.interval), least)

    @cached_property
    def interval(self) -> float:
        """Time between two rows of a channel [s], the median."""
        rows = self.rows()
        same = (np.diff(rows.run) == 0) & (np.diff(rows.channel) == 0)
        return float(np.median(np.diff(rows.time)[same])) if same.any() else math.inf

    def parameters(self) -> dict[str, Parameter]:
        """Every parameter of every candidate, by its name in theta."""
        return {key: p for c in self.candidates.values() for key, p in c.keys().items()}

    # What a right model would leave

    def expected_power(self) -> Array:
        """Mean square (n,) that each row would have if the model were right. Default: one."""
        return np.ones(len(self.rows()))

    def window_errors(self, theta: Theta) -> Mapping[str, Array]:
        """Channel -> measured minus predicted (k,), in the channel's unit, each predicted over a
        short time from the measured motion. Channels that are missing here have none."""
        return {}

    def coarser(self, theta: Theta) -> Self:
        """This problem with what the model at theta lacks as noise of all rows. Default: this."""
        return self

    learns_colour: bool = False  # noise: whether its colour of the noise is learnt from residuals

    def in_detail(self) -> Self:
        """This problem as intervals need it: what no log can tell apart must look the same to the
        last bit. Default: this one."""
        return self

    def recolour(self, residual: Array | None, careful: bool = False) -> Self:
        """This problem with the noise colour learnt from residuals (n,) of a problem without
        colour; None: without colour. `careful`: the model behind these residuals is good, so that
        spikes are no physics and get less weight."""
        return self

    def drifting(self) -> Self | None:
        """This problem with sensors that also drift slowly; None where none do, or all do already.
        Default: none."""
        return None

    def log_density(self) -> float:
        """Log density [nats] of the rows where every residual is zero, up to a constant: the
        sharper the noise, the larger. Default: zero, for noise that stays as it is."""
        return 0.0

    def with_noise_of(self, other: Problem) -> Self:
        """This problem with the noise colour that `other`, logs of the same sensors, has learnt."""
        return self

    def whiten(self, columns: Array) -> Array:
        """Columns (n, k) of a problem without colour as they are under this one's colour."""
        return columns

    # Motion along which the model is linearised

    moves: bool = False  # whether residuals are linearised along a motion that depends on the model

    base: Theta = MappingProxyType({})  # the model with which this motion was found

    def relinearise(self, base: Theta) -> Self:
        """This problem, linearised along the motion that the model at `base` makes of the data.
        Its rows may differ from those of the old one."""
        return self

    def held_back(self, theta: Theta) -> tuple[str, ...]:
        """Parameters that the motion keeps near the values with which it was found: how late the
        sensors are from which it was read."""
        late = (c.key for c in self.candidates.values() if c.sensor and c.lead.unit == "s")
        return tuple(key for key in late if key in theta) if self.moves else ()

    bends: bool = False  # whether slopes differ so much from point to point that each needs its own

    @property
    def curved(self) -> tuple[str, ...]:
        """Nuisance parameters whose slopes are taken anew at every point of a fit."""
        return tuple(self.nuisance if self.bends else self.own_figures)

    def limits(self, name: str) -> tuple[float, float]:
        """Smallest and largest value of a nuisance parameter. Default: its prior is enough."""
        return -math.inf, math.inf

    def is_straight(self, name: str) -> bool:
        """Whether the residual is linear in this parameter, so that its slope tells everything."""
        return False

    # Another structure of the model

    @property
    def structures(self) -> frozenset[str]:
        """Candidates that stand for another structure."""
        return frozenset()

    own_figures: Mapping[str, str] = {}  # of such a structure: nuisance parameter -> its own name

    def rebuilt(self, theta: Theta) -> Self:
        """The same logs under the model with the structure that theta has switched on; its
        figures are nuisance parameters about their usual values. Raises NotImplementedError."""
        raise NotImplementedError("these logs have no other structure")

    # Where each row was taken, and which forces may be missing

    def operating_point(self) -> OperatingPoint:
        """Piston position, speed and force of every row. Default: no row has a piston."""
        return OperatingPoint.nowhere(len(self.rows()))

    def way(self) -> tuple[Array, Flags] | None:
        """Position (n,) of every row on a way that is gone to and fro, and whether it goes forward
        (n,). Default: none."""
        return None

    def commands(self) -> Sequence[Changes]:
        """Per run: command -> times [s] and sizes of its changes. Empty: commands are unknown."""
        return []

    def force_channels(self) -> Sequence[ForceChannel]:
        """Places where a force may be missing."""
        return []

    def missing_force(
        self, theta: Theta | None = None, strength: Array | None = None
    ) -> list[MissingForce]:
        """Estimate of the missing force of every run with its 95 % band.

        `strength` (k,): 1 sigma of each channel's force, learnt when not given. With the same
        strength, estimates at two thetas differ by what the change of theta explains.
        """
        return []

    # Physics that the catalogue lacks

    def formulas(self, theta: Theta) -> Mapping[str, Array]:
        """Simple terms beyond the catalogue: formula -> whitened column (n,) per unit of its
        coefficient."""
        return {}

    def weight(self, theta: Theta, formula: str) -> float:
        """Largest force of a formula per unit of its coefficient, as a share of what matters in
        practice. Default: infinite, so that every formula counts."""
        return math.inf

    def leftover(self, theta: Theta) -> Leftover | None:
        """What the model at theta leaves over, with what it may depend on; None: not known."""
        return None

    # Gate

    def validate(self) -> list[str]:
        """Remarks on the logs. Raises BadData where the logs and the model contradict each other so
        grossly that a column must be wrong."""
        return []
