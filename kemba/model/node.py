"""The residual of a model at one instant: symbols, expressions, and what each row means."""

from dataclasses import dataclass
from functools import cached_property

import casadi as ca

from kemba.quantity import Quantity


@dataclass(frozen=True)
class Row:
    """Where a residual row comes from: `label` is `leg/effect:equation`."""

    label: str
    unit: str
    scale: float = 1.0


@dataclass(frozen=True)
class Node:
    """0 = F(yd, y, lam, u, p), 0 <= a _|_ b >= 0 as SX expressions.

    Symbols: q, v, a (n,), s and sd (effect states and their rates), lam (forces), u (inputs),
    p (free parameters). Expressions: `dynamics` (n,) [N or N.m], `rate` = sd - f (ns,),
    `pair_a`, `pair_b` (np,), `limits` >= 0, `outputs` by column name.
    """

    q: ca.SX
    v: ca.SX
    a: ca.SX
    s: ca.SX
    sd: ca.SX
    lam: ca.SX
    u: ca.SX
    p: ca.SX
    dynamics: ca.SX
    rate: ca.SX
    pair_a: ca.SX
    pair_b: ca.SX
    limits: ca.SX
    outputs: dict[str, ca.SX]
    output_quantities: tuple[Quantity, ...]
    dynamics_rows: tuple[Row, ...]
    rate_rows: tuple[Row, ...]
    pair_rows: tuple[tuple[Row, Row], ...]
    limit_rows: tuple[Row, ...]

    @property
    def symbols(self) -> list[ca.SX]:
        """Symbols q, v, a, s, sd, lam, u, p, each a column vector, in the order in which every
        function built from this node takes them."""
        return [self.q, self.v, self.a, self.s, self.sd, self.lam, self.u, self.p]

    NAMES = ("q", "v", "a", "s", "sd", "lam", "u", "p")

    @cached_property
    def residual(self) -> ca.Function:
        """(q, v, a, s, sd, lam, u, p) -> (dynamics, rate, pair_a, pair_b, limits)."""
        results = ["dynamics", "rate", "pair_a", "pair_b", "limits"]
        return ca.Function(
            "residual", self.symbols, [getattr(self, r) for r in results], list(self.NAMES), results
        )

    @cached_property
    def measure(self) -> ca.Function:
        """(q, v, a, s, sd, lam, u, p) -> every output, in the order of `output_quantities`."""
        columns = ca.vertcat(*(self.outputs[o.name] for o in self.output_quantities))
        return ca.Function("measure", self.symbols, [columns], list(self.NAMES), ["y"])
