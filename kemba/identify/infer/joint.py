"""The model that is written: every effect of an answer at its joint estimate, with its covariance.

One least-squares fit of the whitened residuals over the parameters of all these effects and over
the machine's nominal figures: those of the model's effects, which its list says, and those that
differ from leg to leg and link to link, which its evidence says. What belongs to a recording, zeros
and clocks of sensors, stays as stated. Of rigs whose motion is measured, rows count by the noise as
stated: noise that was learnt under this model would forget what changes slowly.

Intervals come from the slopes at the fit, all nominal figures free within their tolerances, and
from what every absent effect, there with a small share of its size as under every hypothesis of the
search, would add to the estimate. They are widened by as much as blocks of time scatter more than
rows do ("sandwich"), and span what the runs say one by one where these disagree.

What a model lacks is no white noise: it lasts. So the blocks have several lengths, as long as the
motion or shorter; the widest interval counts. Errors that a repeated motion repeats cancel within a
block as long as a repeat, so that one length can be blind.
"""

from collections.abc import Iterator, Mapping
from copy import copy
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.special import chdtrc, stdtrit

from kemba.errors import enumerated
from kemba.identify.answer import Covariance, Value
from kemba.identify.infer.linear import Hypothesis, SpikeSlabSettings, is_shape, time_blocks
from kemba.identify.infer.refit import Frozen, refit
from kemba.identify.infer.windows import START
from kemba.identify.problem.candidates import LINK, ORIFICE
from kemba.identify.problem.problem import Array, Candidate, Labels, Problem, Theta
from kemba.identify.problem.sensor_faults import is_fault
from kemba.model.model import Model

BLOCKS = (12, 24, 48)  # of time, at least; with fewer than 12 the scatter itself is not known
DISAGREE = 0.01  # p-value from which runs disagree
TELLS = 0.1  # share of the best run's information from which a run is asked
OF_A_RUN = 6  # blocks of a run, at least, from which its own scatter is told


def divisions(problem: Problem) -> list[Labels]:
    """Labels (n,) of the rows in blocks of time, and in stretches of a way that is gone to and fro,
    each with two directions: what a model lacks at one place it lacks in every repeat."""
    found = [time_blocks(problem, wanted=count) for count in BLOCKS]
    if (way := problem.way()) is not None:
        place, forward = way
        for count in BLOCKS:
            edges = np.linspace(place.min(), place.max(), count + 1)[1:-1]
            found.append(2 * np.searchsorted(edges, place) + forward)
    return found


def half_widths(labels: Labels, j: Array, r: Array, h: Array) -> Array:
    """Half the 95 % interval (k,) of each parameter, from the scatter of blocks of rows.

    `labels` (n,) of the blocks; `j` (n, k) and `r` (n,): slopes and residual of the fit; `h`
    (k, k): inverse of j'j, priors included.
    """
    pieces = np.stack([j[labels == b].T @ r[labels == b] for b in np.unique(labels)])
    freedom = max(len(pieces) - 1, 1)
    covariance = h @ (pieces.T @ pieces) @ h * len(pieces) / freedom
    return np.asarray(np.sqrt(np.diag(covariance)) * stdtrit(freedom, 0.975))


def conflicts_between_runs(
    problem: Problem, j: Array, r: Array
) -> Iterator[tuple[int, tuple[float, float]]]:
    """Parameters on which runs disagree, and how far from the fit what they say begins and ends.

    `j` (n, k), `r` (n,) as above. A run's own value is told with all others as they are fitted, its
    error by the scatter of its blocks.
    """
    run, count = problem.rows().run, len(problem.runs)
    if count < 2:
        return
    blocks = time_blocks(problem, wanted=OF_A_RUN * count)
    owner = run[np.unique(blocks, return_index=True)[1]]
    for i in range(j.shape[1]):
        power = np.bincount(run, j[:, i] ** 2, count)
        pieces = np.bincount(blocks, j[:, i] * r)
        asked = power > TELLS * power.max()
        scatter = [len(own) * np.var(own, ddof=1) for k in range(count)
                   if len(own := pieces[owner == k]) > 1]  # fmt: skip
        if asked.sum() < 2 or len(scatter) < count:
            continue
        step = -np.bincount(owner, pieces, count)[asked] / power[asked]
        error = np.sqrt(np.maximum(scatter, power)[asked]) / power[asked]
        weight = error**-2.0
        mean = float(weight @ step / weight.sum())
        if chdtrc(int(asked.sum()) - 1, float(weight @ (step - mean) ** 2)) < DISAGREE:
            yield i, (float(step.min()), float(step.max()))


# of what a rig brings along: the figure that its logs tell better than any drawing
RIG_FIGURES = ("measured_chambers.gain", "drive_axis.J", "vessel_chamber.a")
LOOSE = 0.5  # prior sigma of its factor: as good as none
ALIKE = 0.998  # cosine of slopes from which two figures are one
FAR = 3.0  # tolerances by which a figure is off that is told
ROUNDS = 2  # times that the fit begins again with slopes along the figures taken anew

# a share of another structure, and factors of a table, which are no parameters by themselves
NOT_WRITTEN = tuple(f"orifice_chamber.{name}" for name in ("a", "level", "gauge"))


@dataclass(frozen=True)
class JointFit:
    """Effects at their joint estimate.

    `theta`: of the fit. `names` (k,) of all written parameters (`effect.parameter`), with `value`
    (k,), 95 % interval `low`, `high` (k,) and `covariance` (k, k), SI units; `figures`: those that
    the model had already, by name, of a table all its values; `machine`: those of single legs and
    links, as `Evidence.figures`. `remarks`: parameters in which runs disagree.
    """

    theta: Mapping[str, float]
    names: tuple[str, ...]
    value: Array
    low: Array
    high: Array
    covariance: Array
    figures: Mapping[str, Any] = field(default_factory=dict)
    machine: Mapping[str, float] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()

    @property
    def matrix(self) -> Covariance | None:
        """The covariance of all scalar parameters of effects, as a model names them; None where
        there are none."""
        tables = {n for n, value in self.figures.items() if "[" in n or isinstance(value, tuple)}
        told = [name.replace(f"{ORIFICE}.", "orifice_chamber.") for name in self.names]
        keep = [i for i, name in enumerate(told) if name not in {*NOT_WRITTEN, *tables}]
        rows = self.covariance[np.ix_(keep, keep)].tolist()
        return Covariance(tuple(told[i] for i in keep), tuple(map(tuple, rows))) if rows else None

    def _lead(self, candidate: Candidate) -> int | None:
        """Index of an effect's leading parameter; None where it is not fitted, or told by a
        reciprocal."""
        told = candidate.key in self.names and np.isfinite(candidate.lead.off)
        return self.names.index(candidate.key) if told else None

    def holds_absence(self, candidate: Candidate) -> bool:
        """Whether the interval of one effect's leading parameter holds its absence."""
        i = self._lead(candidate)
        return i is not None and bool(self.low[i] <= candidate.lead.off <= self.high[i])

    def share(self, candidate: Candidate) -> float:
        """How far one effect's leading parameter is from absent, in its sizes; infinite where it is
        not told."""
        i, lead = self._lead(candidate), candidate.lead
        return np.inf if i is None else float(abs(self.value[i] - lead.off) / lead.size)

    def values(self, candidate: Candidate) -> dict[str, Value]:
        """The parameters of one effect, as the catalogue has them."""
        found = {}
        for parameter in candidate.parameters:
            name, unit = candidate.reported(parameter)
            i = self.names.index(f"{candidate.effect}.{name}")
            value, low, high = (float(x[i]) for x in (self.value, self.low, self.high))
            found[name] = Value(value, low, high, unit)
        return found


def joint_fit(problem: Problem, hypothesis: Hypothesis, start: Theta) -> JointFit:
    """The effects of a hypothesis and the figures of the model, fitted together from `start`."""
    problem, own, theta = _fitted(problem, hypothesis, start)
    keys = tuple(k for e in hypothesis for k in tuple(problem.candidates[e].keys()))
    return _judged(problem, keys, own, theta)


def joint_estimate(problem: Problem, hypothesis: Hypothesis, start: Theta) -> dict[str, float]:
    """Theta of the same fit."""
    return _fitted(problem, hypothesis, start)[2]


def own_figures(problem: Problem) -> tuple[str, ...]:
    """The nominal figures that are free in the fit: those of the model's effects which its file can
    say, of every leg alike."""
    model = getattr(problem, "model", None)
    if model is None:
        return tuple(problem.nuisance)
    scalars = {f"{e.name}.{p}" for e in model.effects for p in (*e.tolerances(), *e.off)}
    written = scalars | set(problem.own_figures)
    return tuple(n for n in problem.nuisance if n in written)


def _single_figures(problem: Problem) -> tuple[str, ...]:
    """The other nominal figures of the machine: of effects leg by leg, and of links."""
    own, model = own_figures(problem), getattr(problem, "model", None)
    kinds = {e.kind for e in model.effects} if model is not None else set()
    others = (n for n in problem.nuisance if n not in own and not is_fault(n))
    return tuple(n for n in others if n.partition(":")[0] in kinds or n.startswith(LINK))


def without_figure_aliases(problem: Problem, hypothesis: Hypothesis, start: Theta) -> Hypothesis:
    """The hypothesis without faults of sensors that look like a figure which the fit leaves free: a
    force sensor's scale and the bore's gain are one in logs of a cylinder."""
    figures = [n for n in own_figures(problem) if n in RIG_FIGURES]
    faults = [e for e in hypothesis if problem.candidates[e].sensor]
    if not figures or not faults or len(hypothesis) < 2:
        return hypothesis
    keys = [problem.candidates[e].key for e in faults]
    slopes = problem.coarser(start).jacobian(start, [*figures, *keys])
    unit = slopes / np.maximum(np.linalg.norm(slopes, axis=0), 1e-300)
    alike = np.abs(unit[:, : len(figures)].T @ unit[:, len(figures) :]).max(axis=0) > ALIKE
    return tuple(e for e in hypothesis if e not in np.array(faults)[alike])


def _fitted(
    problem: Problem, hypothesis: Hypothesis, start: Theta
) -> tuple[Problem, tuple[str, ...], dict[str, float]]:
    """The problem of the fit, the figures that are free in it, and the best theta."""
    own = own_figures(problem)
    keys = {k for e in hypothesis for k in tuple(problem.candidates[e].keys())}
    starts = (n for n in problem.nuisance if n.startswith(START))
    free = (*own, *_single_figures(problem), *starts)
    theta = {k: v for k, v in start.items() if k in keys or k in free}
    loose = {n: (problem.nuisance[n][0], LOOSE) for n in own if n in RIG_FIGURES}
    candidates = dict(problem.candidates)
    for name in problem.structures & set(hypothesis):  # whole, as the written model has it
        lead = replace(candidates[name].lead, lower=1.0, upper=1.0)
        candidates[name] = replace(candidates[name], lead=lead)
    for _ in range(ROUNDS):
        problem = copy(problem.coarser(theta))
        problem.nuisance, problem.candidates = problem.nuisance | loose, candidates
        theta = refit(problem, hypothesis, theta, Frozen(free, problem.jacobian(theta, free))).theta
    return problem, own, theta


def _judged(
    problem: Problem, keys: tuple[str, ...], own: tuple[str, ...], theta: Theta
) -> JointFit:
    """The fit at theta with its covariance and intervals."""
    problem = problem.in_detail()
    others = tuple(n for n in problem.nuisance if n not in own)
    names = (*keys, *own, *others)
    absent = [c for name, c in problem.candidates.items()
              if c.key not in keys and name not in problem.structures]  # fmt: skip
    slopes = problem.jacobian(theta, (*names, *(c.key for c in absent)))
    jacobian, r = slopes[:, : len(names)], problem.residual(theta)
    parameters = problem.parameters()
    slab, spike = SpikeSlabSettings.slab, SpikeSlabSettings.spike
    width = [
        slab * parameters[k].size * (theta[k] if is_shape(problem, k) else 1.0) for k in keys
    ] + [problem.nuisance[n][1] for n in (*own, *others)]
    scale = np.array(width)
    j = jacobian * scale
    h = np.linalg.inv(j.T @ j + np.eye(len(names)))
    count = len(keys) + len(own)
    small = slopes[:, len(names) :] * [spike * c.lead.size for c in absent]
    bias = (h @ (j.T @ small))[:count] * scale[:count, None]  # by each absent effect, 1 sigma
    spread = np.max([half_widths(labels, j, r, h)[:count] for labels in divisions(problem)], axis=0)
    inflated = np.maximum(spread / np.sqrt(np.diag(h)[:count]) / 1.96, 1.0)
    unit = scale[:count] * inflated
    value = np.array([theta[n] if n in theta else problem.nuisance[n][0] for n in names[:count]])
    size = np.array([abs(theta[k] - parameters[k].off) if np.isfinite(parameters[k].off) and
                     not is_shape(problem, k) else abs(theta[k]) for k in keys])  # fmt: skip
    imperfect = spike * np.append(size, np.zeros(len(own)))
    covariance = np.outer(unit, unit) * h[:count, :count] + bias @ bias.T
    reach = 1.96 * np.hypot(np.sqrt(np.diag(covariance)), imperfect)
    low, high = value - reach, value + reach
    remarks = [_far(problem, names[i], value[i], low[i], high[i]) for i in range(len(keys), count)]
    remarks = [text for text in remarks if text]
    for i, ends in conflicts_between_runs(problem, j[:, :count], r):
        apart = value[i] + scale[i] * np.array(ends)
        if apart.min() < low[i] or apart.max() > high[i]:
            low[i], high[i] = min(low[i], apart.min()), max(high[i], apart.max())
            told = " to ".join(f"{x:.3g}" for x in sorted(apart))
            remarks.append(f"{names[i]} differs between runs ({told}); its interval spans them")
    return _as_written(problem, names[:count], theta, (value, low, high), covariance, remarks)


def _as_written(
    problem: Problem,
    names: tuple[str, ...],
    theta: Theta,
    triple: tuple[Array, Array, Array],
    covariance: Array,
    remarks: list[str],
) -> JointFit:
    """The estimate in the catalogue's names and units, within bounds."""
    value, low, high = (x.copy() for x in triple)
    told, slope, figures = [], np.ones(len(names)), dict[str, Any]()
    ends = np.stack([low, high], axis=1)
    for i, name in enumerate(names):
        effect, parameter = name.rsplit(".", 1) if "." in name else (name, "")
        candidate = problem.candidates.get(effect)
        if candidate is None or name not in theta or name in problem.nuisance:
            told.append(name)
            nominal: Any = 1.0
            if hasattr(problem, "model") and (
                name not in problem.own_figures and not is_fault(name)
            ):
                nominal = given_figure(problem.model, effect, parameter)
            if isinstance(nominal, tuple):
                figures[name] = tuple(float(value[i]) * x for x in nominal)
                continue
            slope[i] = nominal
            value[i], (low[i], high[i]) = nominal * value[i], sorted(nominal * ends[i])
            figures[name] = float(value[i])
            if hasattr(problem, "model") and name in problem.model.parameters:
                declared = problem.model.parameters[name][0]
                figures[name] = float(np.clip(figures[name], declared.lower, declared.upper))
            continue
        bounds = candidate.keys()[name]
        value[i], low[i], high[i] = np.clip([value[i], low[i], high[i]], bounds.lower, bounds.upper)
        if parameter in candidate.reciprocal:
            parameter = candidate.reciprocal[parameter][0]
            slope[i] = -1.0 / max(value[i], 1e-12) ** 2
            value[i], low[i], high[i] = 1.0 / np.maximum([value[i], high[i], low[i]], 1e-12)
        told.append(f"{effect}.{parameter}")
    machine = {n: theta[n] for n in _single_figures(problem) if n in theta}
    return JointFit(
        dict(theta), tuple(told), value, low, high, covariance * np.outer(slope, slope), figures,
        machine, (enumerated(remarks),) if remarks else (),
    )  # fmt: skip


def _far(problem: Problem, name: str, value: float, low: float, high: float) -> str:
    """That a figure of a rig differs from the one given by more than it may; empty where not."""
    model = getattr(problem, "model", None)
    if name not in RIG_FIGURES or model is None:
        return ""
    effect, figure = name.rsplit(".", 1)
    if abs(value - 1.0) < FAR * model.effect(effect).tolerances().get(figure, 0.0):
        return ""
    off = f"{value:.4g} ({low:.4g} to {high:.4g}) times the one given"
    return f"{name} is {off}: more than it may differ by itself, as an area or a sensor's scale may"


def given_figure(model: Model, effect: str, figure: str) -> Any:
    """The value of a figure of a model's effect: a number, a table, or (`fill[0]`) an entry."""
    name, _, entry = figure.partition("[")
    value = model.effect(effect).value(name)
    return float(value[int(entry[:-1])]) if entry else value
