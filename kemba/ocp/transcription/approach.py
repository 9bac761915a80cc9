"""Soft landings: how fast feet may meet the ground and pistons their stops."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca

from kemba.model import Model
from kemba.model.impact import felt
from kemba.ocp.task.requirement import SCALES
from kemba.ocp.transcription.stage import INF, Interval, StageRows
from kemba.ocp.transcription.symmetry import Reduction
from kemba.ocp.transcription.unilateral import rigid_constraints

SPEED = SCALES["m.s-1"]


def approach_rows(
    model: Model,
    reduction: Reduction,
    stage: Interval,
    of_state: Callable[[ca.SX], ca.SX],
    speed: float,
    step: float,
) -> StageRows:
    """Rows of an interval: a gap that closes in it was closing at most at `speed` [m/s].

    rate(y0) + gap(y) / step >= -speed, stops by the length of the leg (`felt`). Where the gap stays
    open by more than it closes within a `step` [s], the row asks for nothing. `of_state`: an
    expression of the node in the stage's y. Feet on a ground that gives way have no rows: it stops
    them, however fast they come.
    """
    rows, labels = [], []
    for constraint in rigid_constraints(model, reduction):
        rate = ca.substitute(of_state(constraint.rate), stage.y, stage.y0)
        own = felt(model.mechanism, constraint.label)
        rows.append(own * (rate + of_state(constraint.gap) / step) / SPEED)
        labels.append(f"landing.impact_speed:{constraint.label}")
    units, scales = ("m.s-1",) * len(rows), (SPEED,) * len(rows)
    low = -speed / SPEED
    return StageRows("requirement", ca.vertcat(*rows), low, INF, tuple(labels), units, scales)
