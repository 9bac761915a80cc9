"""How many elements each phase has: shared by how long the phases last."""

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kemba.ocp.phases.modes import Phase


def meshed(
    phases: Sequence[Phase], lasts: Sequence[float], nodes: int, marks: Sequence[float]
) -> list[Phase] | None:
    """The phases with elements in proportion to `lasts` (phases,), at least one each, `nodes` in
    all.

    `marks`: fractions of the nodes at which the task asks for something; phases end there, before
    and after. None where a phase would be left without an element.
    """
    old = phases[-1].last
    edges = sorted({0.0, 1.0, *(mark for mark in marks if 0.0 < mark < 1.0)})
    fixed = {round(edge * old): round(edge * nodes) for edge in edges}
    counts: list[int] = []
    for a, b in itertools.pairwise(sorted(fixed)):
        inside = [p for p, phase in enumerate(phases) if a <= phase.first and phase.last <= b]
        if not inside or phases[inside[0]].first != a or phases[inside[-1]].last != b:
            return None
        share = _proportional([lasts[p] for p in inside], fixed[b] - fixed[a])
        if share is None:
            return None
        counts += share
    borders = itertools.pairwise([0, *itertools.accumulate(counts)])
    return [replace(p, first=a, last=b) for p, (a, b) in zip(phases, borders, strict=True)]


def _proportional(weights: Sequence[float], total: int) -> list[int] | None:
    """`total` elements shared in proportion to `weights`, at least one each."""
    if total < len(weights):
        return None
    wanted = np.array(weights) * total / sum(weights)
    counts = np.maximum(1, np.round(wanted)).astype(int)
    while counts.sum() != total:
        sign = 1 if counts.sum() < total else -1
        gain = np.where((counts > 1) | (sign > 0), sign * (wanted - counts), -np.inf)
        counts[int(np.argmax(gain))] += sign
    return [int(c) for c in counts]
