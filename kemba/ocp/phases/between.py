"""What holds along a motion, asked for between the nodes as well wherever a solution misses it.

Bounds hold at nodes, gaps at stages. A foot that passes the corner of an obstacle moves centimetres
in an element. Rows at every place in between would be many, of which few matter: those are added
at which a solution misses what is asked, and the program is solved again from there (the exchange
method of semi-infinite programming, Hettich and Kortanek, SIAM Review 35, 1993).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import casadi as ca
import numpy as np

from kemba.ocp.phases.modes import OPEN
from kemba.ocp.phases.program import PhaseProgram, View
from kemba.ocp.phases.radau import scaled
from kemba.ocp.task.requirement import SCALES, quantity_expression
from kemba.ocp.transcription.course import cubic
from kemba.ocp.transcription.layout import STEP

SHARES = tuple(k / 8 for k in range(1, 8))  # of an element: where the certificate looks
HALF = 0.5  # of what it allows there: what is missed by more is asked for


@dataclass(frozen=True)
class Along:
    """low <= g <= high, scaled, along elements; `allowed`: what may be missed between nodes."""

    label: str
    g: ca.SX
    low: float
    high: float
    elements: np.ndarray
    allowed: float


def add_missed(program: PhaseProgram, x: np.ndarray, within: float = 0.0) -> bool:
    """Add rows at the places between nodes where the solution x (size,) misses what holds along the
    motion, or keeps to it by less than `within` [m]; whether there were any."""
    view, c, added = View(program), program.columns, False
    for asked in list(_along(program, view)):
        for share in SHARES:
            z, g = _at(program, view, asked.g, share)
            ends = ((c.begin(e), c.end(e + 1), c.h[c.phase_of[e]]) for e in asked.elements)
            columns = np.array(
                [np.concatenate([a["q"], b["q"], a["v"], b["v"], h]) for a, b, h in ends]
            )
            f = ca.Function("g", [z], [ca.densify(g)])
            values = np.array(f.map(len(columns))(x[columns].T)).ravel()
            over = np.maximum(asked.low - values, values - asked.high)
            there = list(columns[over > HALF * asked.allowed - within / SCALES["m"]])
            program.add(f"{asked.label} between", z, g, asked.low, asked.high, there)
            added |= bool(there)
    return added


def _along(program: PhaseProgram, view: View) -> Iterator[Along]:
    """Lengths and angles of coordinates that are bounded along the motion, and open gaps."""
    node, c = program.model.node, program.columns
    others = ca.vertcat(node.v, node.s, node.lam, node.u)
    may = program.task.tolerances.apex / SCALES["m"]
    for r in program.requirements:
        if r.at is not None or r.quantity.unit not in ("m", "rad") or r.location[0] == "contacts":
            continue
        g, nodes = quantity_expression(program.model, r.quantity.name), r.nodes(program.nodes)
        if len(nodes) > 1 and not ca.depends_on(g, others):
            elements, limits = np.array(nodes[:-1]), (r.lower / r.scale, r.upper / r.scale)
            yield Along(r.label, view.of(g) / r.scale, *limits, elements, may)
    for i, constraint in enumerate(program.constraints):
        is_open = [program.phases[p].modes[i] == OPEN for p in c.phase_of]
        if any(is_open):
            g = view.of(constraint.gap) / SCALES["m"]
            yield Along(constraint.label, g, 0.0, np.inf, np.flatnonzero(is_open), may)


def _at(program: PhaseProgram, view: View, g: ca.SX, share: float) -> tuple[ca.SX, ca.SX]:
    """g at a share of an element, as a function of z: coordinates and rates at both ends, duration.
    The coordinates lie on cubics through these, as the certificate has them."""
    layout = program.layout
    q0, q1, v0, v1 = (scaled(layout, name[0], name) for name in ("q0", "q1", "v0", "v1"))
    h = ca.SX.sym("h")
    scale = {group: ca.DM(layout.scale[layout.slices[group]]) for group in "qv"}
    way0, way1 = (h * STEP * v * scale["v"] / scale["q"] for v in (v0, v1))
    q = cubic(q0, q1, way0, way1, share)
    return ca.vertcat(q0, q1, v0, v1, h), ca.substitute(g, view.symbols["q"], q)
