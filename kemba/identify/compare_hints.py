"""What the error goes with: commands sent before it, and parameters that wander between runs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, norm

from kemba.identify.problem import Array, Problem, Rows

LATEST = 0.04  # s between a command and the error that follows it
CERTAIN = 1e-4
LEAST_INFORMATION = 4.0  # in sizes to the -2: a run that tells less about a parameter is mute
SLACK = 0.1  # sizes by which a parameter may differ between runs without anybody caring


@dataclass(frozen=True)
class Hint:
    """One finding in words; `kind`: command, conflict; the larger `weight`, the plainer."""

    kind: str
    text: str
    weight: float


def hints(problem: Problem, rows: Rows, r: Array, expected: Array) -> Iterable[Hint]:
    """Switchings that an error follows, then parameters in conflict; the plainest first."""
    white = r / np.sqrt(expected)
    commands = getattr(problem, "commands", None)
    found = list(lagged(rows, white, commands())) if commands else []
    found += list(conflicts(problem, rows, r))
    return sorted(found, key=lambda h: (h.kind != "command", -h.weight))


def lagged(
    rows: Rows, white: Array, commands: list[dict[str, tuple[Array, Array]]]
) -> Iterable[Hint]:
    """Error power after each command's change: the lag at which it peaks, per channel.

    `commands`: per run, name -> (times of its changes, size of each change).
    """
    for name in sorted({n for run in commands for n in run}):
        best: tuple[float, float, str] | None = None
        for k, channel in enumerate(rows.channels):
            lag, score = _response(rows, white, rows.channel == k, commands, name)
            if best is None or score > best[1]:
                best = (lag, score, channel)
        if best and best[1] > norm.isf(CERTAIN / (2 * len(rows.channels))):
            text = f"{best[2]} errs {best[0] * 1e3:.0f} ms after {name} switches"
            yield Hint("command", text, best[1])


def _response(
    rows: Rows,
    white: Array,
    own: np.ndarray,
    commands: list[dict[str, tuple[Array, Array]]],
    name: str,
) -> tuple[float, float]:
    """(lag [s], z score) of the mean error, signed by the change, after switchings."""
    edges = np.arange(0.0, LATEST + 1e-9, 0.004)
    total, count = np.zeros(len(edges) - 1), np.zeros(len(edges) - 1)
    for run, own_commands in enumerate(commands):
        if name not in own_commands:
            continue
        here = own & (rows.run == run)
        time, values = rows.time[here], white[here]
        for at, change in zip(*own_commands[name], strict=True):
            place = np.digitize(time - at, edges) - 1
            good = (place >= 0) & (place < len(total))
            np.add.at(total, place[good], np.sign(change) * values[good])
            np.add.at(count, place[good], 1.0)
    z = np.abs(total) / np.sqrt(np.maximum(count, 1.0))
    best = int(np.argmax(z))
    return float(edges[best] + 0.002), float(z[best]) / 2.0  # rows are not quite independent


def conflicts(problem: Problem, rows: Rows, r: Array) -> Iterable[Hint]:
    """Parameters whose best value wanders from run to run more than its error allows."""
    leads = [c for c in problem.candidates.values() if not c.sensor]
    nuisance = list(problem.nuisance)
    jacobian = problem.jacobian({}, [*(c.key for c in leads), *nuisance])
    jacobian *= [c.lead.size for c in leads] + [problem.nuisance[n][1] for n in nuisance]
    per_run = [
        _alone(jacobian[rows.run == i], r[rows.run == i], len(leads))
        for i in range(len(problem.runs))
    ]
    for i, c in enumerate(leads):
        known = [(v[i], w[i]) for v, w in per_run if w[i] > LEAST_INFORMATION]
        if len(known) < 2:
            continue
        a, information = np.array(known).T
        w = 1.0 / (1.0 / information + SLACK**2)
        spread = float(np.sum(w * (a - np.sum(w * a) / np.sum(w)) ** 2))
        p = float(chi2.sf(spread, len(a) - 1))
        if p < CERTAIN / len(leads):
            text = f"{c.key} would have to differ from run to run"
            yield Hint("conflict", text, float(-np.log10(max(p, 1e-30))))


def _alone(jacobian: Array, r: Array, leads: int) -> tuple[Array, Array]:
    """Best value (leads,) and information of each parameter by itself, nuisance free."""
    gram, slope = jacobian.T @ jacobian, jacobian.T @ r
    other = gram[leads:, leads:] + np.eye(len(gram) - leads)
    solved = np.linalg.solve(other, np.column_stack([gram[leads:, :leads], slope[leads:]]))
    cross = gram[:leads, leads:]
    information = np.diag(gram[:leads, :leads]) - np.sum(cross * solved[:, :leads].T, axis=1)
    pull = slope[:leads] - cross @ solved[:, leads]
    return -pull / np.maximum(information, 1e-9), information
