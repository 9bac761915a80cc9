"""A problem linearised at one point: sums over rows, from which all rankings are K x K algebra."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from kemba.identify.problem.problem import (
    Array,
    Candidate,
    Flags,
    Labels,
    Parameter,
    Problem,
    Theta,
)

# Where the linearised problem may lead.
FARTHEST = 4.0  # largest distance of a switch from off, in sizes, where it is tried
WIDTHS = 8.0  # largest distance of a nominal figure from its prior mean, in sigmas
BLOCKS = 4  # fewest blocks: fewer runs are cut in time: for leaving out a quarter
PIECES = 4  # pieces of a run that are told apart: quarters


@dataclass(frozen=True)
class Linear:
    """r(z) = r0 + J (z - at), as sums over b blocks of rows.

    `names` of the k parameters; `at` (k,): where it is linearised; shapes stand as logarithms.
    `mean` and `width` (k,): the prior of each parameter when it is free. `gram` (b, k, k) = J'J,
    `slope` (b, k) = J'r0, `power` (b,) = r0'r0, `count` (b,): rows per block.
    """

    names: tuple[str, ...]
    at: Array
    mean: Array
    width: Array
    gram: Array
    slope: Array
    power: Array
    count: Array

    @property
    def total(self) -> tuple[Array, Array, float]:
        """J'J (k, k), J'r0 (k,) and r0'r0 over all blocks."""
        return self.gram.sum(axis=0), self.slope.sum(axis=0), float(self.power.sum())

    def only(self, keep: Flags) -> Linear:
        """The same with the blocks where `keep` (b,) is true."""
        sums = {name: getattr(self, name)[keep] for name in ("gram", "slope", "power", "count")}
        return replace(self, **sums)

    def index(self, name: str) -> int:
        """Place of a name. Raises ValueError where it is none of `names`."""
        return self.names.index(name)

    def best(self) -> Array:
        """z (k,) of the best fit, every parameter free within its prior."""
        gram, slope, _ = self.total
        h = gram * np.outer(self.width, self.width) + np.eye(len(self.width))
        eta = (self.mean - self.at) / self.width - self.width * slope
        return np.asarray(self.at + self.width * np.linalg.solve(h, eta))

    def cost(self, z: Array) -> float:
        """Half the sum of squares at z (k,), and of how far it is from the priors."""
        (gram, slope, power), step = self.total, z - self.at
        pull = (z - self.mean) / self.width
        return 0.5 * float(power + 2.0 * slope @ step + step @ gram @ step + pull @ pull)


def precision_factor(gram: Array, width: Array) -> Array:
    """Lower Cholesky factor (k, k) of the posterior's precision in prior widths, W J'J W + 1.

    Where strong columns are nearly alike, J'J (k, k) is rounded by more than the 1 that the prior
    gives; so much is added then.
    """
    scaled = gram * np.outer(width, width) + np.eye(len(width))
    try:
        return np.asarray(np.linalg.cholesky(scaled))
    except np.linalg.LinAlgError:
        rounding = len(width) * np.finfo(float).eps * scaled.diagonal().max()
        return np.asarray(np.linalg.cholesky(scaled + rounding * np.eye(len(width))))


def names_of(problem: Problem, theta: Theta) -> tuple[str, ...]:
    """Nuisance, every switch, and the shapes of the effects that are on."""
    switches = (c.key for c in problem.candidates.values())
    return (*problem.nuisance, *switches, *usual_shapes(problem.candidates, theta))


def is_on(theta: Theta, key: str, lead: Parameter) -> bool:
    """Whether theta switches the effect on whose switch is `lead`, named `key`."""
    return theta.get(key, lead.off) != lead.off


def linearise(
    problem: Problem, theta: Theta, blocks: Labels, names: Iterable[str] | None = None
) -> tuple[Linear, Array, Array]:
    """The problem at theta, with J (n, k) and the residual (n,); `blocks` (n,) labels the rows."""
    names = names_of(problem, theta) if names is None else tuple(names)
    r, jacobian = problem.residual(theta), problem.jacobian(theta, names)
    for i, name in enumerate(names):
        if is_shape(problem, name):  # along its logarithm
            jacobian[:, i] *= theta[name]
    return condense(names, *priors(problem, theta, names), jacobian, r, blocks), jacobian, r


def condense(
    names: tuple[str, ...],
    at: Array,
    mean: Array,
    width: Array,
    jacobian: Array,
    r: Array,
    blocks: Labels,
) -> Linear:
    """Sums over each block: `jacobian` (n, k), `r` (n,), `blocks` (n,) labels of the rows; `at`,
    `mean` and `width` (k,) as in `Linear`."""
    masks = (blocks == label for label in np.unique(blocks))
    parts = ((jacobian[own], r[own]) for own in masks)  # one copy at a time
    sums = [(j.T @ j, j.T @ e, float(e @ e), len(e)) for j, e in parts]
    return Linear(tuple(names), at, mean, width, *map(np.array, zip(*sums, strict=True)))


def moved(linear: Linear, at: Array, jacobian: Array, r: Array, blocks: Labels) -> Linear:
    """The same slopes about another point, where the residual is r (n,)."""
    places = np.searchsorted(np.unique(blocks), blocks), np.arange(len(r))
    by_block = sparse.csr_array((r, places))  # quicker than parts of J, which would be copied
    return replace(linear, at=at, slope=by_block @ jacobian, power=by_block @ r)


def within(candidates: Mapping[str, Candidate], theta: Theta) -> dict[str, float]:
    """Theta with every effect's parameters inside their bounds."""
    bounds = {k: p for c in candidates.values() for k, p in c.keys().items()}
    clipped = dict(theta)
    for key in clipped.keys() & bounds.keys():
        p, value = bounds[key], clipped[key]
        if np.isnan(p.typical):  # a switch, which stays within a few sizes of off
            reach = FARTHEST * p.size
            value = np.clip(value, p.off - reach, p.off + reach)
        clipped[key] = float(np.clip(value, p.lower, p.upper))
    return usual_shapes(candidates, clipped) | clipped


def usual_shapes(candidates: Mapping[str, Candidate], theta: Theta) -> dict[str, float]:
    """The usual shapes of the effects that theta switches on."""
    return {
        key: p.typical
        for c in candidates.values()
        if is_on(theta, c.key, c.lead)
        for key, p in c.keys().items()
        if key != c.key
    }


def is_shape(problem: Problem, name: str) -> bool:
    """Whether a name in theta is a shape parameter of an effect."""
    effect = name.rsplit(".", 1)[0]
    candidate = problem.candidates.get(effect)
    return candidate is not None and name != candidate.key


def priors(problem: Problem, theta: Theta, names: Iterable[str]) -> tuple[Array, Array, Array]:
    """Value at theta, prior mean and prior width (k,) of each name; shapes as logarithms."""
    rows = []
    for name in names:
        if name in problem.nuisance:
            nominal, sigma = problem.nuisance[name]
            rows.append((theta.get(name, nominal), nominal, sigma))
            continue
        parameter = problem.candidates[name.rsplit(".", 1)[0]].keys()[name]
        if is_shape(problem, name):
            usual = parameter.typical  # also of an effect that is absent
            rows.append((np.log(theta.get(name, usual)), np.log(usual), parameter.size))
        else:
            rows.append((theta.get(name, parameter.off), parameter.off, parameter.size))
    at, mean, width = np.array(rows).T
    return at, mean, width


def time_blocks(problem: Problem, wanted: int | None = None, shortest: float = 0.0) -> Labels:
    """A label (n,) per row: every run is a block, cut in time where there are fewer runs than
    `wanted` (None: the setting), or cut into pieces of at least `shortest` [s]."""
    wanted = BLOCKS if wanted is None else wanted
    rows = problem.rows()
    pieces = max(1, int(np.ceil(wanted / max(len(problem.runs), 1))))
    labels = np.zeros(len(rows), dtype=int)
    for i in range(len(problem.runs)):
        own = rows.run == i
        t = rows.time[own]
        span = max(float(np.ptp(t)), 1e-9)
        k = max(1, int(span / shortest)) if shortest else pieces
        labels[own] = i * 100000 + np.minimum((t - t.min()) / span * k, k - 1).astype(int)
    return np.unique(labels, return_inverse=True)[1]


def estimate(problem: Problem, linear: Linear, z: Array) -> dict[str, float]:
    """Theta of a vector z (k,); effects whose switch is off are left out.

    Nominal figures stay within their reach: a log that is wrong may ask for a negative rise time.
    """
    theta: dict[str, float] = {}
    for name, value in zip(linear.names, z, strict=True):
        theta[name] = float(np.exp(value)) if is_shape(problem, name) else float(value)
        if name in problem.nuisance:
            nominal, sigma = problem.nuisance[name]
            theta[name] = float(np.clip(value, nominal - WIDTHS * sigma, nominal + WIDTHS * sigma))
    absent = (c for c in problem.candidates.values() if not is_on(theta, c.key, c.lead))
    off = {key for c in absent for key in tuple(c.keys())}
    return {k: v for k, v in theta.items() if k not in off}
