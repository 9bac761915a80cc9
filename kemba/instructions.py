"""The instructions of a CasADi function, applied to other things than numbers."""

from collections.abc import Callable, Sequence
from typing import TypeVar

import casadi as ca

T = TypeVar("T")


def replay(
    f: ca.Function,
    inputs: Sequence[Sequence[T]],
    number: Callable[[float], T],
    apply: Callable[..., T],
) -> list[list[T]]:
    """Every output's nonzeros, from every input's: what `number(constant)` and
    `apply(operation, *operands)` make of f of SX."""
    work: dict[int, T] = {}
    found: list[dict[int, T]] = [{} for _ in range(f.n_out())]
    for k in range(f.n_instructions()):
        kind, at, to = f.instruction_id(k), f.instruction_input(k), f.instruction_output(k)
        if kind == ca.OP_CONST:
            work[to[0]] = number(f.instruction_constant(k))
        elif kind == ca.OP_INPUT:
            work[to[0]] = inputs[at[0]][at[1]]
        elif kind == ca.OP_OUTPUT:
            found[to[0]][to[1]] = work[at[0]]
        else:
            work[to[0]] = apply(kind, *(work[i] for i in at))
    return [[nonzeros[i] for i in range(len(nonzeros))] for nonzeros in found]
