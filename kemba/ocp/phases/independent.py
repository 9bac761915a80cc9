"""Equalities at one node: which of them are linearly independent."""

from __future__ import annotations

import casadi as ca
import numpy as np

from kemba.ocp.phases.settings import ModeConstraints
from kemba.ocp.phases.view import View


class Independent:
    """Equalities at one node, by their gradients with respect to (q, v, s) at a guess.

    Dependent equalities would have no unique multipliers, so they are left out.
    """

    def __init__(self, guess: dict[str, np.ndarray]) -> None:
        self.guess = guess
        self.basis: list[np.ndarray] = []

    def adds(self, g: ca.SX, view: View) -> bool:
        """Whether g = 0 is independent of the equalities so far; if so it becomes one of them."""
        row = self.rest(g, view)
        if row is None:
            return False
        self.basis.append(row / np.linalg.norm(row))
        return True

    def rest(self, g: ca.SX, view: View) -> np.ndarray | None:
        """The part of g's gradient that is orthogonal to all others; None where it is zero."""
        z = view.z("q v s")
        slope = ca.Function("slope", [z], [ca.densify(ca.jacobian(g, z))])
        row = np.array(slope(np.concatenate([self.guess[x] for x in ("q", "v", "s")]))).ravel()
        size = float(np.linalg.norm(row))
        for b in self.basis:
            row = row - (row @ b) * b
        small = ModeConstraints.current().independent
        return None if np.linalg.norm(row) <= small * max(size, small) else row
