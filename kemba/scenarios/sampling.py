"""Drawing the values of a block's cases; the same seed and names give the same draws."""

from __future__ import annotations

import itertools
import math
from statistics import NormalDist
from zlib import crc32

import numpy as np

from kemba.scenarios.schema import Draws, Spread, Value
from kemba.units import read_si

Values = dict[str, Value]


def sample(block: Draws, name: str, seed: int) -> list[Values]:
    """The values of every case: each point of the grid with the same draws of what varies."""
    points = [
        dict(zip(block.grid, p, strict=True)) for p in itertools.product(*block.grid.values())
    ]
    draws = _draws(block, np.random.default_rng([seed, crc32(name.encode())]))
    return [{**point, **draw} for point in points for draw in draws]


def _draws(block: Draws, rng: np.random.Generator) -> list[Values]:
    width = len(block.vary)
    if not width:
        return [{}]
    if block.sampling == "latin_hypercube":
        from scipy.stats import qmc  # half a second, and most callers draw nothing

        table = qmc.LatinHypercube(width, seed=rng).random(block.cases)
    else:
        table = rng.random((block.cases, width))
    spreads = block.vary.items()
    return [
        {key: drawn(spread, float(u)) for (key, spread), u in zip(spreads, row, strict=True)}
        for row in table
    ]


def drawn(spread: Spread, u: float) -> Value:
    """The value of a spread at the quantile `u` in [0, 1), six digits, with its unit."""
    if spread.values:
        return spread.values[int(u * len(spread.values))]
    (a, unit), (b, _) = (read_si(value) for value in spread.ends)
    if spread.whole:
        return min(math.floor(a + (b - a + 1) * u), math.floor(b))
    if spread.mean is not None:
        number = a + b * NormalDist().inv_cdf(min(max(u, 1e-9), 1 - 1e-9))
    else:
        number = a + (b - a) * u
    short = float(f"{number:.6g}")
    return short if unit == "1" else f"{short:.6g} {unit}"
