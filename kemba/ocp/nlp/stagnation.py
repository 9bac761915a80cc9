"""When to give a solve up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kemba.ocp.functions.settings import Newton


@dataclass
class Stagnation:
    """A test that is `found` once the worst scaled violation has not fallen by a fifth within
    `iterations`, unless it was below `small` before."""

    iterations: float
    small: float
    best: float = np.inf
    since: int = 0
    found: bool = False

    def hear(self, iteration: int, violation: float) -> None:
        """Take notice of an iteration."""
        if violation < Newton.current().progress * self.best:
            self.best, self.since = violation, iteration
        self.found = self.best > self.small and iteration - self.since >= self.iterations
