"""Equalities at one node that add something to those already there."""

from __future__ import annotations

import casadi as ca
import numpy as np

from kemba.ocp.refinement.settings import ModeRules
from kemba.ocp.refinement.view import View


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
        small = ModeRules.current().independent
        if np.linalg.norm(row) <= small * max(size, small):
            return False
        self.basis.append(row / np.linalg.norm(row))
        return True
