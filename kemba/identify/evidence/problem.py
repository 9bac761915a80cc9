"""The contract between data and search: logs under one model as whitened residuals.

A bench log and a robot log differ in everything but this. Whoever implements `Problem` owns the
prediction and the noise; ranking, search, confirmation and the answer work on any of them.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np

Array = np.ndarray[Any, np.dtype[np.float64]]
Flags = np.ndarray[Any, np.dtype[np.bool_]]
Labels = np.ndarray[Any, np.dtype[np.int_]]
Theta = Mapping[str, float]  # "seal_friction.F_c" and nuisance names; absent = off, or nominal


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

    def keys(self) -> dict[str, Parameter]:
        """Every parameter by its name in theta."""
        return {f"{self.effect}.{p.name}": p for p in self.parameters}

    def typical(self, sign: float = 1.0) -> dict[str, float]:
        """Theta of this effect at its size."""
        values = {f"{self.effect}.{p.name}": p.typical for p in self.shapes}
        return {self.key: self.lead.off + sign * self.lead.size, **values}


@dataclass(frozen=True)
class Rows:
    """What each residual row is: arrays of one length.

    `run` indexes Problem.runs, `channel` indexes `channels`; `time` [s] in its run; `phase` and
    `mode` are labels ("flight", "10"); rows of one run and channel stand in the order of time.
    `sigma` is the noise (1 sigma, in the channel's unit) that the raw residual was divided by.
    """

    run: np.ndarray[Any, np.dtype[np.int_]]
    channel: np.ndarray[Any, np.dtype[np.int_]]
    time: Array
    phase: np.ndarray[Any, Any]
    mode: np.ndarray[Any, Any]
    channels: tuple[str, ...]
    sigma: Array

    def __len__(self) -> int:
        return len(self.time)


@runtime_checkable
class Problem(Protocol):
    """One set of logs under one model as whitened residuals.

    Residuals (predicted - measured) / noise are about N(0, 1) and white if the model is right.
    """

    runs: tuple[str, ...]
    candidates: dict[str, Candidate]
    nuisance: dict[str, tuple[float, float]]  # nominal, prior sigma; always free within the prior

    def residual(self, theta: Theta, runs: Collection[int] | None = None) -> Array:
        """Whitened residuals (n,) of the runs with these indices, in their order (None: all)."""

    def jacobian(
        self, theta: Theta, names: Iterable[str], runs: Collection[int] | None = None
    ) -> Array:
        """d residual / d names (n, k); a switch that is off is linearised at its size (secant)."""

    def rows(self, runs: Collection[int] | None = None) -> Rows:
        """What each row of `residual` is."""

    def formulas(self, theta: Theta) -> Mapping[str, Array]:
        """Whitened columns (n,) of simple terms beyond the catalogue, by formula; may be empty."""


def secant_jacobian(
    problem: Problem, theta: Theta, names: Iterable[str], runs: Collection[int] | None = None
) -> Array:
    """Finite differences of `residual` with steps of physical size: the default `jacobian`."""
    base = problem.residual(theta, runs)
    known = {key: p for c in problem.candidates.values() for key, p in c.keys().items()}
    columns = []
    for name in names:
        steps = list(parameter_steps(problem, known, theta, name))
        slopes = [(problem.residual({**theta, **step}, runs) - base) / h for step, h in steps]
        columns.append(np.mean(slopes, axis=0))
    return np.stack(columns, axis=1) if columns else np.empty((len(base), 0))


def parameter_steps(
    problem: Problem, known: Mapping[str, Parameter], theta: Theta, name: str
) -> Iterable[tuple[dict[str, float], float]]:
    """Changed entries of theta and the step they mean."""
    if name in problem.nuisance:
        nominal, sigma = problem.nuisance[name]
        yield {name: theta.get(name, nominal) + 0.5 * sigma}, 0.5 * sigma
        return
    parameter = known[name]
    candidate = problem.candidates[name.rsplit(".", 1)[0]]
    if name == candidate.key and theta.get(name, parameter.off) == parameter.off:
        shapes = {k: theta.get(k, p.typical) for k, p in candidate.keys().items() if k != name}
        h = 0.6 * parameter.size
        for sign in (1.0, -1.0) if parameter.signed else (1.0,):
            yield {**shapes, name: parameter.off + sign * h}, sign * h
        return
    value = theta[name]
    h = 0.05 * (parameter.size if name == candidate.key else abs(value))
    h = -h if value + h > parameter.upper else h
    yield {name: value + h}, h


@dataclass(frozen=True)
class Estimate:
    """A fitted theta with its covariance over `names` and what it leaves."""

    theta: dict[str, float]
    names: tuple[str, ...]
    covariance: Array
    cost: float  # 1/2 sum of squared whitened residuals
    log_evidence: float = math.nan
    notes: dict[str, Any] = field(default_factory=dict)
