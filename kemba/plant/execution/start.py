"""The state in which an execution begins: at rest, or in the middle of a motion."""

from __future__ import annotations

import casadi as ca
import numpy as np

from kemba.model import Model
from kemba.model.rest import at_rest
from kemba.trajectory import Trajectory

STILL = 1e-6  # m/s or rad/s; slower is rest


def begins_moving(model: Model, plan: Trajectory) -> bool:
    """Whether a plan begins in motion, so that no execution can wait in its first pose."""
    rates = [plan[q.name][0] for q in model.mechanism.velocities if q.name in plan]
    return bool(np.abs(rates).max(initial=0.0) > STILL)


def moving_start(machine: Model, plan: Trajectory) -> dict[str, float]:
    """Coordinates, rates and effect states of a machine at the start of a plan.

    What the machine computes (the force of a chamber) and the plan has gives the state it comes of
    (the pressure). States of which the plan knows nothing are where they come to rest while the
    first commands are held. Raises KembaError as `at_rest` does.
    """
    mechanism, node = machine.mechanism, machine.node
    listed = [*mechanism.coordinates, *mechanism.velocities, *machine.states.values()]
    found = {q.name: float(plan[q.name][0]) for q in listed if q.name in plan}
    q = np.array([found[c.name] for c in mechanism.coordinates])
    first = min(1, len(plan) - 1)  # inputs act on the interval before a node
    u = [float(plan[i.name][first]) if i.name in plan else 0.0 for i in machine.inputs.values()]
    s = at_rest(machine, q, u)
    names = [state.name for state in machine.states.values()]
    unknown = [i for i, name in enumerate(names) if name not in found]
    for name, value in node.outputs.items():
        symbols = {str(symbol) for symbol in ca.symvar(ca.SX(value))}
        own = [i for i in unknown if str(node.s[i]) in symbols]
        if name in plan and len(own) == 1 and symbols == {str(node.s[own[0]])}:
            i = own[0]
            f = ca.Function("f", [node.s[i]], [value, ca.gradient(value, node.s[i])])
            there, slope = (float(x) for x in f(s[i]))
            s[i] += (float(plan[name][0]) - there) / slope  # outputs are linear in their state
    return {**found, **{names[i]: float(s[i]) for i in unknown}}
