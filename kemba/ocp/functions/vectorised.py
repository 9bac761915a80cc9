"""A function at many points at once, each instruction a loop over the points.

CasADi's own map evaluates point by point, and looks up every instruction again at each point, which
takes several times as long as the arithmetic. Here an instruction is looked up once for all points.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager

import casadi as ca

from kemba.instructions import replay
from kemba.ocp.functions.settings import Functions


def vectorised(f: ca.Function, points: int, shared: Collection[int] = ()) -> ca.Function:
    """f of SX at `points` at once: its inputs (n, points), except the `shared` ones (n,), which
    are the same at all; dense outputs (m, points). Equal to f at every point to the last bit."""
    if points < Functions.current().few or f.class_name() != "SXFunction":
        return f.map(f.name(), "serial", points, list(shared), [])
    widths = [1 if i in shared else points for i in range(f.n_in())]
    inputs = [ca.MX.sym(f.name_in(i), f.numel_in(i), w) for i, w in enumerate(widths)]
    with _as_written():
        rows = [ca.vertsplit(x) if x.numel() else [] for x in inputs]
        outputs = replay(f, [[row.T for row in group] for group in rows], ca.MX, _apply)
        stacked = [_stacked(found, points) for found in outputs]
        return ca.Function(f.name(), inputs, stacked, {"never_inline": True})


def _apply(kind: int, *operands: ca.MX) -> ca.MX:
    if len(operands) == 1:
        return ca.MX.unary(kind, operands[0])
    return ca.MX.binary(kind, operands[0], operands[1])


def _stacked(elements: list[ca.MX], points: int) -> ca.MX:
    """Elements (points,), or scalars that are the same at all, as rows."""
    rows = [e if e.numel() == points else ca.repmat(e, points) for e in elements]
    return ca.horzcat(*rows).T if rows else ca.MX(0, points)


@contextmanager
def _as_written() -> Iterator[None]:
    """Without CasADi's simplifications, which may change the rounding."""
    before = ca.GlobalOptions.getSimplificationOnTheFly()
    ca.GlobalOptions.setSimplificationOnTheFly(False)
    try:
        yield
    finally:
        ca.GlobalOptions.setSimplificationOnTheFly(before)
