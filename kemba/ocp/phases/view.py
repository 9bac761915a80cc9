"""Expressions of the model's node in the scaled symbols of a multi-phase program."""

from __future__ import annotations

import casadi as ca

from kemba.ocp.phases.program import PhaseProgram
from kemba.ocp.phases.radau import node_vector, scaled


class View:
    """The node's expressions as functions of scaled half symbols q, v, s, u, lam."""

    def __init__(self, program: PhaseProgram) -> None:
        self.layout, self.node = program.layout, program.model.node
        groups = ("q", "v", "s", "u", "lam")
        self.symbols = {g: scaled(self.layout, g, g) for g in groups}
        y = node_vector(self.layout, self.symbols)
        self._full = [ca.densify(self.layout.full(y, g)) for g in groups]

    def of(self, expression: ca.SX) -> ca.SX:
        """An expression of the node's symbols in the half ones."""
        node = self.node
        symbols = [node.q, node.v, node.s, node.u, node.lam]
        return ca.SX(ca.cse(ca.densify(ca.substitute([ca.SX(expression)], symbols, self._full)[0])))

    def z(self, groups: str) -> ca.SX:
        """The symbols of some groups, such as "q v"."""
        return ca.vertcat(*(self.symbols[g] for g in groups.split()))
