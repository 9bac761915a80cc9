"""Costs: what one step adds to the time integral of each, by name or by an expression."""

from collections.abc import Callable, Mapping

import casadi as ca

from kemba.model import Model
from kemba.ocp.task.requirement import quantity_expression
from kemba.ocp.task.task import CostTerm

Cost = Callable[[Model, ca.SX, ca.SX], ca.SX]  # model, inputs u of a step, its length h [s]


def torque_squared(model: Model, u: ca.SX, h: ca.SX) -> ca.SX:
    """Squared motor torques [N2.m2.s] (paper, eq. 9)."""
    return h * ca.sumsqr(u[[i for i, q in enumerate(model.inputs.values()) if q.unit == "N.m"]])


def air(model: Model, u: ca.SX, h: ca.SX) -> ca.SX:
    """Time for which valves stand open [s], summed over the valves."""
    return h * ca.sum1(u[[i for i, q in enumerate(model.inputs.values()) if q.binary]])


def duration(model: Model, u: ca.SX, h: ca.SX) -> ca.SX:
    """Duration of the motion [s]."""
    return h


COSTS: dict[str, Cost] = {"torque_squared": torque_squared, "air": air, "duration": duration}


def running(
    model: Model, cost: Mapping[str, float | CostTerm], now: Mapping[str, ca.SX], h: ca.SX
) -> ca.SX:
    """What a step of length h [s] adds to the weighted costs.

    `now`: q, v, s, u, lam of the whole robot, each a column vector, at the end of the step.
    """
    total = ca.SX(0)
    for name, term in cost.items():
        if isinstance(term, CostTerm):
            value = quantity_expression(model, term.expression)
            symbols = [getattr(model.node, group) for group in model.groups]
            here = [ca.densify(now[group]) for group in model.groups]
            total += term.weight * h * ca.substitute([ca.SX(value)], symbols, here)[0]
        else:
            total += term * COSTS[name](model, now["u"], h)
    return total


def scaled(cost: Mapping[str, float | CostTerm], factor: float) -> dict[str, float | CostTerm]:
    """The same costs, each weighted `factor` times as much."""

    def one(term: float | CostTerm) -> float | CostTerm:
        if isinstance(term, CostTerm):
            return term.model_copy(update={"weight": factor * term.weight})
        return factor * term

    return {name: one(term) for name, term in cost.items()}
