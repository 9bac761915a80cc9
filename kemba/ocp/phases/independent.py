"""Equalities at one node: which of them are linearly independent, and whether the others agree."""

from __future__ import annotations

import casadi as ca
import numpy as np

from kemba.ocp.phases.settings import ModeConstraints
from kemba.ocp.phases.view import View

AGREES = 1e-4  # of a scaled quantity; a dependent equality with another value contradicts the rest
STEPS = 10  # of Gauss and Newton to a point on the equalities


class ContradictionError(ValueError):
    """An equality that asks for another value than those from which it follows."""


class Independent:
    """Equalities at one node, by their gradients with respect to (q, v, s) at a guess.

    Dependent equalities would have no unique multipliers, so they are left out.
    """

    def __init__(self, guess: dict[str, np.ndarray]) -> None:
        self.guess = np.concatenate([guess[x] for x in ("q", "v", "s")])
        self.basis: list[np.ndarray] = []
        self.kept: list[ca.Function] = []

    def adds(self, g: ca.SX, view: View, what: str) -> bool:
        """Whether g = 0 (g is a scalar) is independent of the equalities so far; if so it joins
        them. Raises ContradictionError, which names `what` is asked, where these exclude it."""
        equality = _with_slope(g, view)
        row = self._rest(equality, self.guess, self.basis)
        if row is None:
            there = self._where_all_hold()
            if abs(float(equality(there)[0])) <= AGREES:
                return False
            # gradients may depend at one point alone: legs that stand right below their hips
            basis: list[np.ndarray] = []
            for kept in self.kept:
                own = self._rest(kept, there, basis)
                basis += [] if own is None else [own]
            row = self._rest(equality, there, basis)
        if row is None:
            raise ContradictionError(f"the order of contacts and stops excludes {what}")
        self.basis.append(row)
        self.kept.append(equality)
        return True

    def grants(self, g: ca.SX, view: View) -> bool:
        """Whether the equalities so far decide a scalar g."""
        return self._rest(_with_slope(g, view), self.guess, self.basis) is None

    def _rest(
        self, equality: ca.Function, at: np.ndarray, basis: list[np.ndarray]
    ) -> np.ndarray | None:
        """The direction (n,) in which the gradient at a point (n,) leaves a basis; None if none."""
        row = np.array(equality(at)[1]).ravel()
        size = float(np.linalg.norm(row))
        for b in basis:
            row = row - (row @ b) * b
        small, left = ModeConstraints.current().independent, float(np.linalg.norm(row))
        return None if left <= small * max(size, small) else row / left

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
