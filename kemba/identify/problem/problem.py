"""The contract between logs and search: a set of logs under one model, as whitened residuals.

A bench log and a robot log differ in everything but this contract. A subclass of `Problem` owns
the prediction and the noise. Ranking, search, doubts and the answer work on any `Problem`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
from typing_extensions import Self

from kemba.model.model import Model

Array = np.ndarray[Any, np.dtype[np.float64]]
Flags = np.ndarray[Any, np.dtype[np.bool_]]
Labels = np.ndarray[Any, np.dtype[np.int_]]
Texts = np.ndarray[Any, Any]  # words, one per row

# Values by name: "seal_friction.F_c", or the name of a nuisance parameter. A parameter of an effect
# that is not listed is off; a nuisance parameter that is not listed is nominal.
Theta = Mapping[str, float]
Changes = Mapping[str, tuple[Array, Array]]  # command -> times [s] and sizes of its changes

REGIONS = ("in", "mid", "out")

# length of the region at each end of the stroke [m]: as long as the cushion of the catalogue
END = 0.010


@dataclass(frozen=True)
class Parameter:
    """One number of an effect: `off` is its value when the effect is absent.

    `size` is the prior width about `off` (a switch) or, in ln units, about `typical` (a shape).
    """

    name: str
    unit: str = "1"
    off: float = 0.0
    size: float = 1.0
    lower: float = -math.inf
    upper: float = math.inf
    typical: float = math.nan  # of a shape parameter: where a fit starts

    @property
    def signed(self) -> bool:
        """Whether values on both sides of `off` are possible."""
        return self.lower < self.off


@dataclass(frozen=True)
class Candidate:
    """An effect that may be missing: `lead` switches it on, `shapes` matter only when it is on."""

    effect: str
    lead: Parameter
    shapes: tuple[Parameter, ...] = ()
    sensor: bool = False
    law_of: str = ""  # of laws of one thing, an answer names one
    # searched as 1/value, reported as the catalogue has it: {"softness": ("k", "N.m-1")}
    reciprocal: Mapping[str, tuple[str, str]] = field(default_factory=dict)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (self.lead, *self.shapes)

    @property
    def key(self) -> str:
        """Name of the switch in theta: `seal_friction.F_c`."""
        return f"{self.effect}.{self.lead.name}"

    def is_on(self, theta: Theta) -> bool:
        """Whether theta switches the effect on."""
        return theta.get(self.key, self.lead.off) != self.lead.off

    def reported(self, parameter: Parameter) -> tuple[str, str]:
        """Name and unit of a parameter as the catalogue has it."""
        return self.reciprocal.get(parameter.name, (parameter.name, parameter.unit))

    def keys(self) -> dict[str, Parameter]:
        """Every parameter by its name in theta."""
        return {f"{self.effect}.{p.name}": p for p in self.parameters}

    def typical(self) -> dict[str, float]:
        """Theta of this effect at its size."""
        values = {f"{self.effect}.{p.name}": p.typical for p in self.shapes}
        return {self.key: self.lead.off + self.lead.size, **values}


@dataclass(frozen=True)
class Rows:
    """What each residual row is: arrays of one length (n,).

    `run` indexes Problem.runs, `channel` indexes `channels`; `time` [s] in its run; `phase` and
    `mode` are labels ("flight", "10"); rows of one run and channel stand in the order of time.
    `sigma` is the noise (1 sigma, in the channel's unit) that the raw residual was divided by.
    `units` of channels by name, where their names do not tell them.
    """

    run: Labels
    channel: Labels
    time: Array
    phase: Texts
    mode: Texts
    channels: tuple[str, ...]
    sigma: Array
    units: Mapping[str, str] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.time)


@dataclass(frozen=True)
class OperatingPoint:
    """The piston of each row (n,): position `x` [m], speed `v` [m.s-1], and the `force` [N] with
    which the model's air pushes it; `stroke` [m]. NaN where a row has no piston."""

    x: Array
    v: Array
    force: Array
    stroke: float

    @classmethod
    def nowhere(cls, count: int) -> OperatingPoint:
        """The operating point of `count` rows that no piston belongs to."""
        unknown = np.full(count, np.nan)
        return cls(unknown, unknown, unknown, math.nan)

    def regions(self) -> Texts:
        """Label (n,) of each row: `in` near the retracted end of the stroke, `mid`, `out` near the
        extended end; an empty text without a piston."""
        ends = np.array([END, self.stroke - END])
        index = np.searchsorted(ends, self.x, side="right")
        return np.array([*REGIONS, ""], dtype=object)[np.where(np.isfinite(self.x), index, -1)]


@dataclass(frozen=True)
class ForceChannel:
    """A place where a force may be missing: a rod, a hip, an axis of the body.

    `usual`: a force [unit] that is neither small nor large here. `quantities`: what the force may
    depend on, by label, one array (samples...) each. `columns`: turns forces (samples..., b) into
    columns (rows, b) of the whitened residual per unit of force. `after`: by command how much the
    command changed within each lag before a sample, (samples..., lags).
    """

    name: str
    unit: str
    usual: float
    quantities: Mapping[str, Array]
    columns: Callable[[Array], Array]
    after: Mapping[str, Array] = field(default_factory=dict)


@dataclass(frozen=True)
class MissingForce:
    """Missing force of one run: `force` and its 1 sigma (n, k) at `time` (n,) [s], per channel.

    `strength`: 1 sigma (k,) that each channel is taken to have; `stance`: spans [s] in which a foot
    is down, so that contact hides most of what is missing.
    """

    run: str
    time: Array
    channels: tuple[str, ...]
    units: tuple[str, ...]
    force: Array
    sigma: Array
    strength: Array
    stance: tuple[tuple[float, float], ...] = ()

    def band(self) -> tuple[Array, Array]:
        """Low and high ends (n, k) of the 95 % interval."""
        return self.force - 1.96 * self.sigma, self.force + 1.96 * self.sigma

    def evidence(self) -> Array:
        """Mean square (k,) of the force in its own sigma: how plainly each channel lacks one."""
        return np.asarray(np.mean((self.force / self.sigma) ** 2, axis=0))


NUISANCE = 0.5  # step of a nominal figure, in prior sigmas
PARAMETER = 0.05  # step of a parameter that is on, as a share of its size or value
ABSURD = 1e5  # residual in sigmas at which nothing can be predicted: beyond data


def bounded(residual: Array, absurd: float) -> Array:
    """Residuals (n,) within `absurd` sigmas; those that are no numbers are as large as that."""
    return np.asarray(np.clip(np.nan_to_num(residual, nan=absurd), -absurd, absurd))


def mean_slope(base: Array, steps: Sequence[tuple[Array, float]]) -> Array:
    """Mean slope (n,) of residuals `base` (n,) over finite steps: the residuals there and how far
    each goes. Zero where every step leads to where nothing can be predicted: a rod that is driven
    through its cylinder's end leaves no volume to the air."""
    most = max(ABSURD, 10.0 * float(np.max(np.abs(base), initial=0.0)))
    known = [(there - base) / h for there, h in steps if np.all(np.abs(there) < most)]
    return np.asarray(np.mean(known, axis=0)) if known else np.zeros_like(base)


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

    def each_residual(self, thetas: Sequence[Theta]) -> Iterator[Array]:
        """Whitened residuals (n,) of all runs at each theta in turn; quicker where a problem can
        share work between them."""
        return map(self.residual, thetas)

    def residuals(self, thetas: Sequence[Theta]) -> Array:
        """The same (n, c) of c thetas at once."""
        return np.stack(list(self.each_residual(thetas)), axis=1)

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
        steps = [list(self.steps(theta, name)) for name in names]
        moved = [{**theta, **step} for group in steps for step, _ in group]
        there = self.each_residual([theta, *moved])
        base = next(there)
        columns = [mean_slope(base, [(next(there), h) for _, h in group]) for group in steps]
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
        if name == candidate.key and not candidate.is_on(theta):
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

    def leftover(self, theta: Theta) -> tuple[Array, Array, Labels] | None:
        """What the model at theta leaves over, in units of the noise and not whitened (n,), what a
        missing force could be a function of (n, m), and the run of each row (n,). None: not known.
        """
        return None

    # Gate

    def validate(self) -> list[str]:
        """Remarks on the logs. Raises BadData where the logs and the model contradict each other so
        grossly that a column must be wrong."""
        return []
