"""How long steps are: as long as the results of both stages of a step agree."""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

from kemba.plant.kernel.jit import part
from kemba.plant.kernel.settings import StepControl
from kemba.plant.stepping.arrays import Array

_CONTROL = StepControl.current()
GROWTH, SHRINKING, SAFETY = _CONTROL.growth, _CONTROL.shrinking, _CONTROL.safety


class Pace(NamedTuple):
    """`step` (1,) is the present length, from `shortest` to `longest` [s].

    Of a step the result of the first stage, first order, may differ from that of both by
    `tolerance`, see `step`; infinite for steps of equal length.
    """

    step: Array
    shortest: float
    longest: float
    tolerance: float


@part
def keeps_pace(pace: Pace, h: float, apart: float) -> bool:
    """Whether a step of `h` [s] was short enough; sets the length of the next one.

    `apart`: how far the results of its stages differ. It grows with the square of the length.
    """
    if apart < 1e-9 * pace.tolerance:
        factor = GROWTH
    else:
        factor = min(GROWTH, max(SHRINKING, SAFETY * sqrt(pace.tolerance / apart)))
    again = apart > pace.tolerance and h > 1.001 * pace.shortest
    wanted = h * factor
    if not again and h < SAFETY * pace.step[0]:  # cut by an event or a mark
        wanted = max(wanted, pace.step[0])
    pace.step[0] = min(pace.longest, max(pace.shortest, wanted))
    return not again
