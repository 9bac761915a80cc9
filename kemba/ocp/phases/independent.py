"""Equalities at one node: which of them are linearly independent, and whether the others agree."""

import casadi as ca
import numpy as np

from kemba.ocp.phases.program import View
from kemba.ocp.phases.settings import ModeConstraints

AGREES = 1e-4  # of a scaled quantity; a dependent equality with another value contradicts the rest
STEPS = 10  # of Gauss and Newton to a point on the equalities


class ContradictionError(ValueError):
    """An equality that asks for another value than those from which it follows."""


class Independent:
    """Equalities at one node, by their gradients with respect to (q, v, s) at a guess.

    Dependent equalities would have no unique multipliers, so they are left out. Gradients are taken
    at the velocities at which the equalities hold: at others a rate that follows from further ones
    has a slope by the coordinates, and would pass for a condition on these.
    """

    def __init__(self, guess: dict[str, np.ndarray]) -> None:
        self.guess = np.concatenate([guess[x] for x in ("q", "v", "s")])
        self.velocities = slice(len(guess["q"]), len(guess["q"]) + len(guess["v"]))
        self.kept: list[ca.Function] = []

    def adds(self, g: ca.SX, view: View, what: str) -> bool:
        """Whether g = 0 (g is a scalar) is independent of the equalities so far; if so it joins
        them. Raises ContradictionError, which names `what` is asked, where these exclude it."""
        equality, there = _with_slope(g, view), self._where_all_hold()
        if not self._leaves(equality, self._moving(there)):
            if abs(float(equality(there)[0])) <= AGREES:
                return False
            # gradients may depend at one point alone: legs that stand right below their hips
            if not self._leaves(equality, there):
                raise ContradictionError(f"the order of contacts and stops excludes {what}")
        self.kept.append(equality)
        return True

    def grants(self, g: ca.SX, view: View) -> bool:
        """Whether the equalities so far decide a scalar g."""
        return not self._leaves(_with_slope(g, view), self._moving(self._where_all_hold()))

    def _moving(self, there: np.ndarray) -> np.ndarray:
        """The guess (n,) with the velocities of another point (n,)."""
        point: np.ndarray = self.guess.copy()
        point[self.velocities] = there[self.velocities]
        return point

    def _leaves(self, equality: ca.Function, at: np.ndarray) -> bool:
        """Whether the gradient at a point (n,) leaves the span of those of the equalities so
        far."""
        small, basis = ModeConstraints.independent, np.zeros((0, len(at)))
        for one in (*self.kept, equality):
            row = np.array(one(at)[1]).ravel()
            size = float(np.linalg.norm(row))
            for b in basis:
                row = row - (row @ b) * b
            left = float(np.linalg.norm(row))
            independent = left > small * max(size, small)
            if independent:
                basis = np.vstack([basis, row / left])
        return independent

    def _where_all_hold(self) -> np.ndarray:
        """The point (n,) near the guess at which all equalities so far hold."""
        x = self.guess
        for _ in range(STEPS if self.kept else 0):
            parts = [kept(x) for kept in self.kept]
            left = np.array([float(value) for value, _ in parts])
            if np.abs(left).max() < AGREES * AGREES:
                break
            slopes = np.vstack([np.array(slope) for _, slope in parts])
            x = x - np.linalg.lstsq(slopes, left, rcond=None)[0]
        return x


def _with_slope(g: ca.SX, view: View) -> ca.Function:
    """A scalar g and its gradient (1, n) as a function of (q, v, s)."""
    z = view.z("q v s")
    return ca.Function("equality", [z], [ca.densify(g), ca.densify(ca.jacobian(g, z))])
