"""The bench rig: one piston whose motion is imposed and whose force is the answer."""

from __future__ import annotations

import casadi as ca

from kemba.mechanism.cylinder import Cylinder
from kemba.mechanism.planar import Mechanism, Port
from kemba.quantity import Quantity


def rig_mechanism(cylinder: Cylinder) -> Mechanism:
    """A piston on the bench: one coordinate, its extension `piston/x` [m], massless."""
    q, v, a = ca.SX.sym("q"), ca.SX.sym("v"), ca.SX.sym("a")
    x = Quantity("piston/x", "m", 0.0, cylinder.stroke, 0.02, doc="piston extension, 0 retracted")
    rate = Quantity("piston/v", "m.s-1", -5.0, 5.0, 0.5, doc="piston rate")
    return Mechanism(
        name="rig",
        q=q,
        v=v,
        a=a,
        coordinates=(x,),
        velocities=(rate,),
        inverse_dynamics=ca.SX.zeros(1),
        ports={"piston/x": Port(x, rate, q)},
        legs=("",),
        gravity=0.0,  # nothing hangs on the rod
        cylinder=cylinder,
        imposed=True,
    )
