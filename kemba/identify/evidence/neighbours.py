"""Evidence of many hypotheses that differ from one in a few effects, from one factor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kemba.identify.problem.types import Array, Labels


@dataclass(frozen=True)
class Neighbours:
    """A Gaussian problem with prior widths (k,), solved once.

    `covariance` (k, k) and `step` (k,): posterior; `eta` . `step`, `quadratic` and `log_det` as the
    evidence of the base hypothesis needs them. `shift` (k,): prior mean minus the point.
    """

    width: Array
    shift: Array
    covariance: Array
    step: Array
    fitted: float
    quadratic: float
    log_det: float

    @classmethod
    def of(cls, gram: Array, slope: Array, power: float, shift: Array, width: Array) -> Neighbours:
        """The problem of `Linear` sums under the prior `width` (k,)."""
        eta = shift / width**2 - slope
        scaled = gram * np.outer(width, width) + np.eye(len(width))
        lower = np.linalg.cholesky(scaled)
        root = np.linalg.solve(lower, np.diag(width))
        covariance = root.T @ root
        step = covariance @ eta
        quadratic = power + float(np.sum((shift / width) ** 2))
        log_det = 2.0 * float(np.sum(np.log(np.diag(lower))))
        return cls(width, shift, covariance, step, float(eta @ step), quadratic, log_det)

    def with_widths(
        self, changed: Sequence[int], width: Array, wanted: Labels
    ) -> tuple[float, Array, Array]:
        """Log evidence where the parameters `changed` have the prior `width` instead; their steps
        and those of the others in `wanted` (m,), and 1 sigma (m,) of these.

        Sherman, Morrison and Woodbury: only matrices of the size of `changed` are inverted.
        """
        i, j = np.asarray(changed, dtype=int), wanted
        old = self.width[i]
        delta = 1.0 / width**2 - 1.0 / old**2
        push = delta * self.shift[i]
        C = self.covariance[np.ix_(i, i)]
        D = self.covariance[np.ix_(j, i)]
        inner = np.eye(len(i)) + C * delta
        mixed = np.linalg.solve(inner.T, np.diag(delta)).T
        y = self.step[i] + C @ push
        fitted = self.fitted + 2.0 * float(push @ self.step[i]) + float(push @ C @ push)
        fitted -= float(y @ mixed @ y)
        quadratic = self.quadratic + float(np.sum(delta * self.shift[i] ** 2)) - fitted
        log_det = self.log_det + float(np.log(np.linalg.det(inner)))
        log_det += 2.0 * float(np.sum(np.log(width / old)))
        step = self.step[j] + D @ push - D @ mixed @ y
        variance = self.covariance[j, j] - np.einsum("ab,bc,ac->a", D, mixed, D)
        return -0.5 * (quadratic + log_det), step, np.sqrt(np.maximum(variance, 0.0))
