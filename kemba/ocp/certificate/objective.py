"""The cost of a plan as its task weighs it, to compare plans of one task."""

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from kemba.model import Model
from kemba.ocp.task.costs import running
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import CostTerm, Task
from kemba.ocp.transcription.solution import arrays
from kemba.ocp.transcription.stage import AIM, COST_SCALE
from kemba.trajectory import Trajectory


def integral(cost: Mapping[str, float | CostTerm], model: Model, plan: Trajectory) -> float:
    """The time integral of weighted costs over a plan, by its nodes."""
    x, h, node = arrays(model, plan), np.diff(plan.time), model.node
    step = ca.SX.sym("h")
    now = {"q": node.q, "v": node.v, "s": node.s, "u": node.u, "lam": node.lam}
    f = ca.Function("cost", [*now.values(), step], [running(model, cost, now, step)])
    return float(ca.sum2(f.map(len(h))(*(x[group][1:].T for group in now), h[None, :])))


def objective(
    model: Model, task: Task, requirements: Sequence[Requirement], plan: Trajectory
) -> float:
    """Weighted costs of a plan, less what is gained by quantities that are to be large or small."""
    total = integral(task.cost, model, plan)
    for asked in (r for r in requirements if r.aim and r.at is not None):
        value = float(plan[asked.quantity.name][asked.node(len(plan) - 1)])
        total -= COST_SCALE * AIM * asked.aim * value / asked.scale
    return total


def costs(model: Model, plan: Trajectory) -> dict[str, float]:
    """Time integrals of a plan: squared hip torque [N2.m2.s], open valve time [s]."""
    keys = {"torque_squared": "torque_squared_integral", "air": "valve_open_s"}
    return {key: integral({name: 1.0}, model, plan) for name, key in keys.items()}
