"""What a node's vector holds: q, v, s, u, lam, h, scaled, possibly of half a robot."""

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np

from kemba.model import Model
from kemba.model.model import Node
from kemba.ocp.transcription.symmetry import Reduction
from kemba.quantity import Quantity

STEP = 0.005  # s; scale of the steps, the same for every grid so that all share their code
GROUPS = ("q", "v", "s", "u", "lam", "h")


class Layout:
    """Slices, scales and bounds of y = [q, v, s, u, lam, h] in half coordinates.

    `slices` and `quantities` by group; `scale`, `lower`, `upper` (n,): physical = scale * y, the
    bounds are on y. Coordinates are counted from the mechanism's `origin`.
    """

    def __init__(self, model: Model, reduction: Reduction, step: float, variation: float) -> None:
        mechanism = model.mechanism
        h = Quantity("step", "s", step * (1 - variation), step * (1 + variation), STEP)
        full = {**model.groups, "h": (h,)}
        self.reduction = reduction
        self.quantities = {g: self._kept(g, full[g]) for g in GROUPS}
        self.slices: dict[str, slice] = {}
        listed: list[Quantity] = []
        for group in GROUPS:
            start = len(listed)
            listed += self.quantities[group]
            self.slices[group] = slice(start, len(listed))
        self.size = len(listed)
        self.scale = np.array([q.scale for q in listed])
        self.origin = np.array(mechanism.origin)
        zero = np.zeros(self.size)
        zero[self.slices["q"]] = [q.value for q in self.quantities["q"]]
        self.lower = (np.array([q.lower for q in listed]) - zero) / self.scale
        self.upper = (np.array([q.upper for q in listed]) - zero) / self.scale
        inputs, first = self.quantities["u"], self.slices["u"].start
        self.binary = [first + i for i, q in enumerate(inputs) if q.binary]

    def _matrix(self, group: str) -> np.ndarray:
        if group == "h":
            return np.eye(1)
        return self.reduction.B["q" if group == "v" else group]

    def _kept(self, group: str, full: Sequence[Quantity]) -> list[Quantity]:
        matrix = self._matrix(group)
        return [full[int(np.argmax(np.abs(matrix[:, j])))] for j in range(matrix.shape[1])]

    def half(self, y: Any, group: str) -> Any:
        """Physical half values of a group, of coordinates what they are beyond the origin: of a
        symbol y (n,), or of rows Y (..., n)."""
        part = self.slices[group]
        if isinstance(y, ca.SX):
            return y[part] * ca.DM(self.scale[part])
        return y[..., part] * self.scale[part]

    def full(self, y: Any, group: str) -> Any:
        """Physical values of a group for the whole robot."""
        zero = self.origin if group == "q" else 0.0
        if isinstance(y, ca.SX):
            return ca.mtimes(ca.sparsify(ca.DM(self._matrix(group))), self.half(y, group)) + zero
        return self.half(y, group) @ self._matrix(group).T + zero

    def reader(self, node: Node, y: ca.SX) -> Callable[[ca.SX], ca.SX]:
        """What turns expressions of the whole robot's q, v, s, u and lam into ones of a vector
        `y` (size,) of scaled half coordinates."""
        symbols = [getattr(node, g) for g in GROUPS if g != "h"]
        full = [ca.densify(self.full(y, g)) for g in GROUPS if g != "h"]

        def read(expression: ca.SX) -> ca.SX:
            found = ca.substitute([ca.SX(expression)], symbols, full)[0]
            return ca.SX(ca.cse(ca.densify(found)))

        return read

    def pack(self, groups: dict[str, np.ndarray]) -> np.ndarray:
        """Rows Y (..., n) of physical full values per group."""
        parts = []
        for group in GROUPS:
            matrix = self._matrix(group)
            mean = matrix / np.maximum((matrix**2).sum(axis=0), 1e-300)
            values = groups[group] - self.origin if group == "q" else groups[group]
            parts.append(values @ mean / self.scale[self.slices[group]])
        return np.concatenate(parts, axis=-1)
