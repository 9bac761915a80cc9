"""When to give a solve up."""

from __future__ import annotations

from dataclasses import dataclass, field
from time import thread_time

import numpy as np

from kemba.ocp.functions.settings import Newton

USUAL = 5  # iterations by whose median time others are called long


@dataclass
class Stagnation:
    """A test that is `found` once the worst scaled violation has not fallen by a fifth within
    `iterations`, unless it was below `small` before; or once long iterations have cost as much time
    as `slow` usual ones: the linear systems are nearly singular, and more of them follow."""

    iterations: float
    small: float
    slow: float = np.inf
    best: float = np.inf
    since: int = 0
    found: bool = False
    ends: list[float] = field(default_factory=list)  # of iterations, processor time [s]

    def hear(self, iteration: int, violation: float) -> None:
        """Take notice of an iteration."""
        self.ends.append(thread_time())
        if violation < Newton.current().progress * self.best:
            self.best, self.since = violation, iteration
        stuck = self.best > self.small and iteration - self.since >= self.iterations
        self.found = stuck or self.too_slow()

    def too_slow(self) -> bool:
        """Whether long iterations have cost too much."""
        lasted = np.diff(self.ends)
        if len(lasted) <= USUAL:
            return False
        usual = float(np.median(lasted[:USUAL]))
        return bool(lasted.sum() - len(lasted) * usual > self.slow * usual)
