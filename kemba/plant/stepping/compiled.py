"""CasADi functions on fixed memory."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca
import numpy as np

from kemba.plant.stepping.arrays import Array


class Compiled:
    """A function of named vectors on fixed memory: called with values, it returns views.

    The views are overwritten by the next call.
    """

    def __init__(
        self, name: str, inputs: Mapping[str, ca.SX], outputs: Mapping[str, ca.SX]
    ) -> None:
        flat = [
            ca.densify(ca.vertcat(*(ca.vec(ca.densify(value)) for value in group.values())))
            for group in (inputs, outputs)
        ]
        self.function = ca.Function(name, flat[:1], flat[1:])
        x, y = np.zeros(flat[0].numel()), np.zeros(flat[1].numel())
        self._x = _views(x, {key: value.shape for key, value in inputs.items()})
        self._y = _views(y, {key: value.shape for key, value in outputs.items()})
        buffer: Any
        buffer, self._call = self.function.buffer()
        buffer.set_arg(0, memoryview(x))  # type: ignore[arg-type]
        buffer.set_res(0, memoryview(y))  # type: ignore[arg-type]
        self._buffer = buffer  # holds the memory

    def __call__(self, **values: Any) -> dict[str, Array]:
        for key, value in values.items():
            self._x[key][...] = value
        self._call()
        return self._y


def _views(flat: Array, shapes: Mapping[str, tuple[int, int]]) -> dict[str, Array]:
    views, start = {}, 0
    for key, (rows, columns) in shapes.items():
        part = flat[start : start + rows * columns]
        views[key] = part if columns == 1 else part.reshape((rows, columns), order="F")
        start += rows * columns
    return views
