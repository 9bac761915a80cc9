"""Equalities at one node that add something to those already there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

if TYPE_CHECKING:
    from kemba.ocp.refinement.mode_constraints import View

SMALL = 1e-6


class Independent:
    """Gradients with respect to (q, v, s) of the equalities that hold at one node, at a guess."""

    def __init__(self, guess: dict[str, np.ndarray]) -> None:
        self.guess = guess
        self.basis: list[np.ndarray] = []

    def adds(self, g: ca.SX, view: View) -> bool:
        """Whether g = 0 is independent of what holds; if so it holds from now on."""
        z = view.z("q v s")
        slope = ca.Function("slope", [z], [ca.densify(ca.jacobian(g, z))])
        row = np.array(slope(np.concatenate([self.guess[x] for x in ("q", "v", "s")]))).ravel()
        size = float(np.linalg.norm(row))
        for b in self.basis:
            row = row - (row @ b) * b
        if np.linalg.norm(row) <= SMALL * max(size, SMALL):
            return False
        self.basis.append(row / np.linalg.norm(row))
        return True
