"""Sliding: the feet are pulled together and pushed apart over the ground, then the knees rise by a
short push and sink with both valves open. So a log shows how rough the ground is, and the loss of
both valves open, which jumps and squats may leave out."""

import numpy as np

from .plan import Demand, Sight, record
from .scripts import Script, Start, clock

RISE, SINK = 0.07, 0.24  # s, of a push and of the way down


class Slides:
    """Goal: strides of the feet towards each other, each of its own width, then rises of knees."""

    def __init__(self, rng, strides: int = 3, rises: int = 2):
        self.widths = rng.uniform(0.25, 0.4, strides)
        self.lengths = rng.uniform(0.22, 0.3, strides)
        self.share = rng.uniform(0.8, 1.0, strides)  # of the rear foot
        self.pushes = rng.uniform(RISE, RISE + 0.02, rises)
        self.skew = rng.uniform(-0.003, 0.003, (rises, 2))
        self.ends = 0.04 + np.cumsum(self.lengths)
        self.end = self.ends[-1] + 0.06 + rises * (RISE + SINK)

    def __call__(self, see: Sight) -> Demand:
        stride = int(np.searchsorted(self.ends, see.t))
        if stride < len(self.ends):
            begin = self.ends[stride] - self.lengths[stride]
            phase = np.clip((see.t - begin) / self.lengths[stride], 0.0, 1.0)
            wide = self.widths[stride] * np.sin(np.pi * phase) ** 2
            return Demand(valves=(0, 0, 0, 0), hip_offset=(-wide, wide * self.share[stride]))
        number, t = divmod(see.t - self.ends[-1] - 0.06, RISE + SINK)
        if not 0 <= number < len(self.pushes):
            return Demand(valves=(0, 0, 0, 0))
        on = [int(t < self.pushes[int(number)] + skew) for skew in self.skew[int(number)]]
        return Demand(valves=(1, 1 - on[0], 1, 1 - on[1]))

    def finished(self, see: Sight) -> bool:
        return see.t > self.end


def slide(rng, rate=1000.0, jitter=0.0) -> Script:
    """Standing: feet that slide, then knees that sink with both valves open."""
    goal = Slides(rng)
    return record("slide", clock(2.0, rate, jitter, rng), Start(), goal, stop=goal.finished)
