"""The search for the best test: differential evolution over a cube, with a bounded effort."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from kemba.identify.design.settings import DesignSearchSettings
from kemba.identify.problem.problem import Array


@dataclass(frozen=True)
class Best:
    """The best point (k,) of the unit cube, its worth, and how many points were tried."""

    point: Array
    worth: float
    tried: int


def best_point(
    worth: Callable[[Array], float],
    begin: Array,
    say: Callable[[str], None] = lambda text: None,
    bounded: bool = True,
) -> Best:
    """The point of the unit cube that is worth most, as far as a bounded search finds it.

    `begin` (m, k): the first points that are tried. `bounded`: stop when the time is over; without
    it the answer depends on nothing but the seed.
    """
    from scipy.optimize import differential_evolution

    settings, started = DesignSearchSettings, time.monotonic()
    seen: list[tuple[float, Array]] = []

    def cost(point: Array) -> float:
        over = bounded and time.monotonic() - started > settings.budget
        if over and seen:
            return 0.0
        value = worth(np.asarray(point))
        seen.append((value if np.isfinite(value) else 0.0, np.array(point)))
        return -seen[-1][0]

    def report(best: Array, convergence: float) -> bool:
        top = max(value for value, _ in seen)
        say(f"{len(seen)} tests tried; the best is worth {top:.2f}")
        return bounded and time.monotonic() - started > settings.budget

    differential_evolution(
        cost,
        [(0.0, 1.0)] * begin.shape[1],
        init=np.clip(begin, 0.0, 1.0),
        maxiter=settings.generations,
        rng=np.random.default_rng(settings.seed),
        polish=False,
        tol=0.0,
        callback=report,
    )
    top, point = max(seen, key=lambda item: item[0])
    return Best(point, top, len(seen))
