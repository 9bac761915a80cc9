"""The parts of the contract between logs and search: parameters, rows, operating points, forces."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

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
    # searched as 1/value, reported as the catalogue has it: {"softness": ("k", "N.m-1")}
    reciprocal: Mapping[str, tuple[str, str]] = field(default_factory=dict)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (self.lead, *self.shapes)

    @property
    def key(self) -> str:
        """Name of the switch in theta: `seal_friction.F_c`."""
        return f"{self.effect}.{self.lead.name}"

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


@dataclass(frozen=True)
class Leftover:
    """What a fit leaves over, and what it may depend on.

    `residual` (n,): in units of the noise, not whitened. `features` (n, m): quantities that a
    missing force could be a function of. `run` (n,): index of each row's run.
    """

    residual: Array
    features: Array
    run: Labels
