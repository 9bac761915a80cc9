"""Costs by name: what one step adds to the time integral of each."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca

from kemba.model import Model

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


COSTS: dict[str, Cost] = {
    "torque_squared": torque_squared,
    "air": air,
    "duration": duration,
}
