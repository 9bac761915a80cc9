"""Constants of expressions as parameters: tasks that differ only in numbers share their code."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from kemba.instructions import replay

SHAPING = (-1.0, 0.0, 0.5, 1.0, 2.0)  # CasADi simplifies expressions with these numbers


def parameterised(
    inputs: Sequence[ca.SX], outputs: Sequence[ca.SX]
) -> tuple[list[ca.SX], ca.SX, np.ndarray]:
    """The dense outputs with a symbol (k,) for their distinct constants, and the values (k,)."""
    f = ca.Function("f", list(inputs), list(outputs))
    given = [ca.vertsplit(ca.vec(ca.densify(x))) for x in inputs]
    symbols: dict[float, ca.SX] = {}

    def number(value: float) -> ca.SX:
        if value in SHAPING:
            return ca.SX(value)
        return symbols.setdefault(value, ca.SX.sym(f"c{len(symbols)}"))

    def apply(kind: int, *operands: ca.SX) -> ca.SX:
        return (ca.SX.unary if len(operands) == 1 else ca.SX.binary)(kind, *operands)

    found = replay(f, given, number, apply)
    results = [ca.SX.zeros(f.sparsity_out(i)) for i in range(f.n_out())]
    for result, nonzeros in zip(results, found, strict=True):
        result.nz[:] = ca.vertcat(*nonzeros)
    return results, ca.vertcat(*symbols.values()), np.array(list(symbols))
