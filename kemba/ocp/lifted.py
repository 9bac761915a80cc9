"""Expressions with their numbers taken out, so that code is shared by all that differ in them."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

SHAPING = (-1.0, 0.0, 0.5, 1.0, 2.0)  # numbers that decide what an expression simplifies to


def lifted(
    inputs: Sequence[ca.SX], outputs: Sequence[ca.SX]
) -> tuple[list[ca.SX], ca.SX, np.ndarray]:
    """The dense outputs with a symbol (k,) for their distinct constants, and the values (k,)."""
    f = ca.Function("f", list(inputs), list(outputs))
    given = [ca.vertsplit(ca.vec(ca.densify(x))) for x in inputs]
    work: dict[int, ca.SX] = {}
    symbols: dict[float, ca.SX] = {}
    found = [ca.SX.zeros(f.sparsity_out(i)) for i in range(f.n_out())]
    for k in range(f.n_instructions()):
        kind, at, to = f.instruction_id(k), f.instruction_input(k), f.instruction_output(k)
        if kind == ca.OP_CONST:
            value = f.instruction_constant(k)
            if value in SHAPING:
                work[to[0]] = ca.SX(value)
            else:
                work[to[0]] = symbols.setdefault(value, ca.SX.sym(f"c{len(symbols)}"))
        elif kind == ca.OP_INPUT:
            work[to[0]] = given[at[0]][at[1]]
        elif kind == ca.OP_OUTPUT:
            found[to[0]].nz[to[1]] = work[at[0]]
        elif len(at) == 1:
            work[to[0]] = ca.SX.unary(kind, work[at[0]])
        else:
            work[to[0]] = ca.SX.binary(kind, work[at[0]], work[at[1]])
    return found, ca.vertcat(*symbols.values()), np.array(list(symbols))
