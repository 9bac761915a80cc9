"""Drawing the values of a block's cases; the same seed and names give the same draws."""

from __future__ import annotations

import itertools
import math
from statistics import NormalDist
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from kemba.scenarios.schema import Draws, Spread, Value
from kemba.units import read_si

Array = NDArray[np.float64]
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
        table = latin_hypercube(rng, block.cases, width)
    else:
        table = rng.random((block.cases, width))
    spreads = block.vary.items()
    return [
        {key: drawn(spread, float(u)) for (key, spread), u in zip(spreads, row, strict=True)}
        for row in table
    ]


def latin_hypercube(rng: np.random.Generator, count: int, width: int) -> Array:
    """Points (count, width) in [0, 1), in every column one in each of `count` equal parts.

    The points of `scipy.stats.qmc.LatinHypercube`, whose import takes half a second of a plan.
    """
    own = rng.spawn(1)[0]
    within = own.random((count, width))
    parts = np.tile(np.arange(1, count + 1), (width, 1))
    for column in parts:
        own.shuffle(column)
    return np.asarray((parts.T - within) / count)


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
