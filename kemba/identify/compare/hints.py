"""What the error goes with: a force by speed, position or load, commands sent before it, and
parameters that would have to differ between runs or between valve modes."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, ndtr, ndtri

from kemba.identify.compare.bins import false_discoveries
from kemba.identify.compare.force_profiles import (
    PLAIN,
    ForceProfile,
    lags,
    middle,
    rises,
)
from kemba.identify.compare.words import command, quantity
from kemba.identify.infer.linear import SpikeSlabSettings
from kemba.identify.infer.windows import codes
from kemba.identify.problem.problem import Array, Candidate, Labels, Problem, Rows, Theta


@dataclass(frozen=True)
class Slopes:
    """Slopes of a residual.

    `by_lead` (n, leads): along the switch of every effect, per size. `by_nuisance` (n, nuisance):
    along every nuisance parameter, per prior sigma.
    """

    leads: tuple[Candidate, ...]
    by_lead: Array
    by_nuisance: Array


def slopes(problem: Problem, at: Theta) -> Slopes:
    """Slopes at theta `at`, of all effects but sensor faults."""
    leads = tuple(c for c in problem.candidates.values() if not c.sensor)
    nuisance = list(problem.nuisance)
    jacobian = problem.jacobian(at, [*(c.key for c in leads), *nuisance])
    jacobian = jacobian * (
        [c.lead.size for c in leads] + [problem.nuisance[n][1] for n in nuisance]
    )
    return Slopes(leads, jacobian[:, : len(leads)], jacobian[:, len(leads) :])


def within_tolerance(residual: Array, known: Slopes) -> tuple[Array, float]:
    """The likeliest explanation of a residual (n,) by a model that lacks nothing: what it leaves
    (n,), and the q value of the figure or absent effect that is farthest off, which controls false
    discoveries over all of them.

    Each nuisance parameter is off by about its prior sigma, and each absent effect is there with a
    small share of its size, as under every hypothesis of `discover`. The likeliest values, in units
    of these sigmas, are then no larger than standard normal numbers are.
    """
    spike = SpikeSlabSettings.spike
    columns = np.hstack([spike * known.by_lead, known.by_nuisance])
    h = columns.T @ columns + np.eye(columns.shape[1])
    off = -np.linalg.solve(h, columns.T @ residual)
    q = false_discoveries(2.0 * ndtr(-np.abs(off))) if len(off) else np.ones(1)
    return residual + columns @ off, float(q.min())


CERTAIN = 1e-4  # p-value below which a hint is certain, over all that were tried
DEPENDENT = 1.5  # z scores are divided by this: rows are not quite independent
INFORMATION = 4.0  # information on a parameter, per size squared, that a run must give


@dataclass(frozen=True)
class Hint:
    """One thing that the error goes with, in words.

    `kind`: `law` (a missing force that goes with a quantity), `command` or `conflict`. The larger
    `weight`, the clearer it is.
    """

    kind: str
    text: str
    weight: float


def lacking(found: Sequence[ForceProfile]) -> list[Hint]:
    """The missing force that explains most, if it explains enough."""
    best = max(found, key=lambda profile: profile.gain, default=None)
    if best is None or best.gain <= PLAIN or not best.largest:
        return []
    return [Hint("law", str(best), best.gain)]


def after_commands(problem: Problem, rows: Rows, white: Array) -> list[Hint]:
    """For every command the channel whose error follows its changes most clearly, where that is
    certain; the clearest first.

    `white` (n,): residual with unit variance where the model is right. A command's rise within each
    lag is the regressor of every channel's error.
    """
    found, names = [], sorted({n for run in problem.commands() for n in run})
    for name in names:
        rise = rises(problem, rows, name)
        z = np.zeros((len(rows.channels), rise.shape[1]))
        for k in range(len(z)):
            own = rows.channel == k
            power = np.sum(rise[own] ** 2, axis=0)
            score = white[own] @ rise[own] / np.sqrt(np.maximum(power, 1e-12)) / DEPENDENT
            z[k] = np.where(power > 1e-9 * np.max(power, initial=1e-12), score, 0.0)
        k, lag = divmod(int(np.argmax(np.abs(z))), z.shape[1])
        if abs(z[k, lag]) > -ndtri(CERTAIN / (2 * len(names) * len(z))):
            late = f"{middle(lags())[lag] * 1e3:.0f} ms after {command(name)}"
            verb = "switches" if "valve/" in name else "changes"
            what = f"the prediction of {quantity(rows.channels[k])} goes wrong {late} {verb}"
            found.append(Hint("command", what, float(abs(z[k, lag]))))
    return sorted(found, key=lambda hint: -hint.weight)


def conflicts(rows: Rows, r: Array, known: Slopes) -> list[Hint]:
    """Parameters whose best values differ by more than their error allows, from run to run or from
    one valve mode to another; the clearest first. `r` (n,): the residual."""
    valves = _wandering(r, known, codes(rows.mode), "all positions of the valves")
    found = [*_wandering(r, known, rows.run, "all runs"), *valves]
    return sorted(found, key=lambda h: -h.weight)


def _wandering(r: Array, known: Slopes, group: Labels, text: str) -> Iterable[Hint]:
    """Each effect's switch with one value per `group` (n,) of rows against one value for all."""
    parts = [group == i for i in np.unique(group)]
    by_part = [(known.by_lead[own], known.by_nuisance[own], r[own]) for own in parts]
    power = np.stack([np.sum(j * j, axis=0) for j, _, _ in by_part])
    cross = np.stack([j.T @ n for j, n, _ in by_part])
    slope = np.stack([j.T @ own for j, _, own in by_part])
    n = known.by_nuisance
    solve = np.linalg.inv(n.T @ n + np.eye(n.shape[1]))
    for i, c in enumerate(known.leads):
        told = np.flatnonzero(power[:, i] > INFORMATION)
        own = cross[told, i]
        information = np.diag(power[told, i]) - own @ solve @ own.T
        p = _agreement(information, own @ solve @ (n.T @ r) - slope[told, i])
        if p < CERTAIN / len(known.leads):
            weight = float(-np.log10(max(p, 1e-300)))
            what = f"no one value of {c.key} fits {text}"
            yield Hint("conflict", f"{what}, so the model lacks something else", weight)


def _agreement(information: Array, pull: Array) -> float:
    """p value of one value for all groups, from `information` (g, g) and `pull` (g,) at zero."""
    if len(pull) < 2:
        return 1.0
    imperfect = SpikeSlabSettings.spike
    spread = np.linalg.pinv(information, rcond=1e-9, hermitian=True)
    a = spread @ pull
    certainty = np.linalg.inv(spread + imperfect**2 * np.eye(len(a)))
    ones = np.ones(len(a))
    apart = a - ones @ certainty @ a / (ones @ certainty @ ones)
    return float(chdtrc(len(a) - 1, float(apart @ certainty @ apart)))
