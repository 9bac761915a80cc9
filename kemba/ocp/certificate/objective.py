"""The cost of a plan as its task weighs it, to compare plans of one task."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from kemba.model import Model
from kemba.ocp.task.costs import COSTS
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.solution import arrays
from kemba.ocp.transcription.stage import AIM, COST_SCALE
from kemba.trajectory import Trajectory


def integral(name: str, model: Model, plan: Trajectory) -> float:
    """The time integral of one of the costs over a plan."""
    u, h = arrays(model, plan)["u"][1:], np.diff(plan.time)
    symbol, step = ca.SX.sym("u", u.shape[1]), ca.SX.sym("h")
    f = ca.Function(name, [symbol, step], [COSTS[name](model, symbol, step)])
    return float(ca.sum2(f.map(len(h))(u.T, h[None, :])))


def objective(
    model: Model, task: Task, requirements: Sequence[Requirement], plan: Trajectory
) -> float:
    """Weighted costs of a plan, less what is gained by quantities that are to be large or small."""
    total = sum(weight * integral(name, model, plan) for name, weight in task.cost.items())
    for asked in (r for r in requirements if r.aim and r.at is not None):
        value = float(plan[asked.quantity.name][asked.node(len(plan) - 1)])
        total -= COST_SCALE * AIM * asked.aim * value / asked.scale
    return total


def costs(model: Model, plan: Trajectory) -> dict[str, float]:
    """Time integrals of a plan: squared hip torque [N2.m2.s], open valve time [s]."""
    keys = {"torque_squared": "torque_squared_integral", "air": "valve_open_s"}
    return {key: integral(name, model, plan) for name, key in keys.items()}
