"""A function over many samples at once, in machine code."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from kemba.identify.problem.types import Array
from kemba.machine_code import Native


class SampleMap:
    """A function of samples; the answers are those of CasADi's own machine."""

    def __init__(self, function: ca.Function) -> None:
        given = function.sx_in()
        outputs = function.call(given)
        self._name = function.name()
        self._widths = [symbol.numel() for symbol in given]
        self._shapes = [output.shape for output in outputs]
        by_rows = [ca.reshape(output.T, output.numel(), 1) for output in outputs]
        self._code = Native(given, {self._name: [ca.vertcat(*by_rows)]})

    def __call__(self, samples: Sequence[Array], p: Array | None = None) -> list[Array]:
        """Arrays (N, rows) or (N, rows, columns) from samples (N, .); `p` (k,): the last input,
        the same for every sample."""
        given = [*samples] if p is None else [*samples, p]
        count = len(samples[0])
        x = np.empty((count, sum(self._widths)))
        edges = np.cumsum([0, *self._widths])
        for values, first, end in zip(given, edges[:-1], edges[1:], strict=True):
            x[:, first:end] = values
        y = np.zeros((count, sum(rows * columns for rows, columns in self._shapes)))
        self._code.rows(self._name, x, y)
        ends = np.cumsum([rows * columns for rows, columns in self._shapes])
        blocks = np.split(y, ends[:-1], axis=1)
        return [
            block if columns == 1 else block.reshape(count, rows, columns)
            for block, (rows, columns) in zip(blocks, self._shapes, strict=True)
        ]
