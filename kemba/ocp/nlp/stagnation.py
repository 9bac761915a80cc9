"""When to give a solve up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

GAVE_UP = "No_Progress"
PROGRESS = 0.8  # the part of the violation that may be left


@dataclass
class Stagnation:
    """Is `lost` once the worst scaled violation has not fallen by a fifth in `iterations`, unless
    it was below `small` before."""

    iterations: float
    small: float
    best: float = np.inf
    since: int = 0
    lost: bool = False

    def hear(self, iteration: int, violation: float) -> None:
        """Take notice of an iteration."""
        if violation < PROGRESS * self.best:
            self.best, self.since = violation, iteration
        self.lost = self.best > self.small and iteration - self.since >= self.iterations
