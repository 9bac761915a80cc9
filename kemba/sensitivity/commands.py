"""The same commands on a changed machine: the controller's table simulated with every change."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kemba.errors import KembaError
from kemba.model import Model
from kemba.plant.controller import Execution, execute_many
from kemba.plant.replay import rest_after
from kemba.sensitivity.figures import FigureStep
from kemba.trajectory import Trajectory

NAN = float("nan")


@dataclass(frozen=True)
class Shift:
    """What one step of a figure changes: apex [m], touchdown [s], where the body ends [m].

    NaN where an execution fails or does not land. `lands`: whether both executions end standing.
    """

    apex: float = NAN
    touchdown: float = NAN
    end_x: float = NAN
    end_z: float = NAN
    lands: bool = False


def of_commands(
    model: Model,
    plan: Trajectory,
    table: Trajectory,
    changed: Sequence[FigureStep],
    jobs: int | None = None,
) -> list[Shift]:
    """For every figure of `changed`, the difference between half a step above and half below.

    The table goes through eq. 10 and the dead time, as on the robot. `plan`: the plan that the
    table was made from. Raises KembaError where the table does not fit the model.
    """
    rest = rest_after(model, plan, table)
    models = [side[1] for figure in changed for side in figure.sides()]
    done = execute_many(table, [{"model": m, "extra": rest} for m in models], jobs)
    pairs = zip(done[::2], done[1::2], models[::2], models[1::2], strict=True)
    return [_difference(plan, *pair) for pair in pairs]


def _difference(
    plan: Trajectory,
    low: Execution | KembaError,
    high: Execution | KembaError,
    below: Model,
    above: Model,
) -> Shift:
    if isinstance(low, KembaError) or isinstance(high, KembaError):
        return Shift()
    first, second = low.against(below, plan), high.against(above, plan)
    late = [np.nan if r.touchdown_error_s is None else r.touchdown_error_s for r in (first, second)]
    ends = [[run.trajectory[name][-1] for name in ("body/x", "body/z")] for run in (first, second)]
    x, z = (float(b - a) for a, b in zip(*ends, strict=True))
    return Shift(
        apex=second.apex_error_m - first.apex_error_m,
        touchdown=float(late[1] - late[0]),
        end_x=x,
        end_z=z,
        lands=first.landed and second.landed,
    )
