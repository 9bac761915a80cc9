"""One step of implicit Euler as scaled, labelled rows of two neighbouring nodes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from kemba.model import Model
from kemba.ocp.task.costs import running
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import CostTerm
from kemba.ocp.transcription.layout import STEP, Layout
from kemba.ocp.transcription.symmetry import Reduction

ANGLE_ARM = 0.2  # m; turns a moment defect into a force defect
COST_SCALE = 10.0  # N2.m2.s; makes a plan's cost 0.01 to 10 beside penalties near one
ROUNDED = 1e-9  # of a scaled variable
AIM = 3.0  # of the scaled cost, for a scale of a quantity that is to be large or small

INF = np.inf


@dataclass(frozen=True)
class StageRows:
    """Labelled rows lower <= g <= upper of one kind: defect, pair, sign, limit or requirement."""

    kind: str
    g: ca.SX
    lower: float
    upper: float
    labels: Sequence[str]


@dataclass(frozen=True)
class Interval:
    """Symbols and rows of one interval between the nodes y0 and y.

    Parameters: `eps` relaxes the pairs; `weights` = (valve penalty, switching, pair
    penalty, squared forces).
    """

    layout: Layout
    y0: ca.SX
    y: ca.SX
    eps: ca.SX
    weights: ca.SX
    rows: tuple[StageRows, ...]
    cost: ca.SX

    @property
    def g(self) -> ca.SX:
        """All rows (m,)."""
        return ca.vertcat(*(r.g for r in self.rows))


def build_stage(
    model: Model, layout: Layout, reduction: Reduction, cost: Mapping[str, float | CostTerm]
) -> Interval:
    """The stage of any grid."""
    y0, y = ca.SX.sym("y0", layout.size), ca.SX.sym("y", layout.size)
    node, h = model.node, layout.half(y, "h")
    now = {group: layout.full(y, group) for group in ("q", "v", "s", "u", "lam")}
    v0, s0 = layout.full(y0, "v"), layout.full(y0, "s")
    at = [now["q"], now["v"], (now["v"] - v0) / h, now["s"], (now["s"] - s0) / h]
    parts = node.residual.call([*at, now["lam"], now["u"], ca.SX(0, 1)])
    dynamics, rate, pair_a, pair_b, limits = parts
    eps, weights = ca.SX.sym("eps"), ca.SX.sym("weights", 4)
    a = pair_a[reduction.pairs]
    b = pair_b[reduction.pairs] / ca.DM([node.pair_rows[i][1].scale for i in reduction.pairs])
    pairs = [node.pair_rows[i][0].label for i in reduction.pairs]
    limited = [node.limit_rows[i].label for i in reduction.limits]
    rows = (
        _kinematics(layout, y0, y, h),
        _momentum(model, layout, reduction, dynamics, h),
        _rates(model, reduction, rate, h),
        StageRows("pair", a * b - eps, -INF, 0.0, pairs),
        _signs(a, y, layout, pairs),
        _signs(b, y, layout, pairs),
        StageRows("limit", ca.SX(limits[reduction.limits]), 0.0, INF, limited),
    )
    own = running(model, cost, now, h) / COST_SCALE
    objective = own + _penalties(layout, y0, y, a * b, weights)
    kept = tuple(r for r in rows if r.g.numel())
    return Interval(layout, y0, y, eps, weights, kept, ca.densify(ca.SX(objective)))


def _penalties(layout: Layout, y0: ca.SX, y: ca.SX, product: ca.SX, weights: ca.SX) -> ca.SX:
    """What a schedule adds to the task's cost, see `Parameters`."""
    u, u0, h = y[layout.binary], y0[layout.binary], layout.half(y, "h")
    return ca.SX(
        weights[0] * ca.sum1(u * (1 - u))
        + weights[1] * ca.sumsqr(u - u0)
        + weights[2] * ca.sum1(product)
        + weights[3] * ca.sumsqr(y[layout.slices["lam"]]) * h / STEP
    )


def _defects(g: ca.SX, labels: Sequence[str]) -> StageRows:
    return StageRows("defect", ca.SX(g), 0.0, 0.0, labels)


def _kinematics(layout: Layout, y0: ca.SX, y: ca.SX, h: ca.SX) -> StageRows:
    kept = layout.quantities["q"]
    g = layout.half(y, "q") - layout.half(y0, "q") - h * layout.half(y, "v")
    return _defects(g / ca.DM([q.scale for q in kept]), [f"kinematics:{q.name}" for q in kept])


def _momentum(
    model: Model, layout: Layout, reduction: Reduction, dynamics: ca.SX, h: ca.SX
) -> StageRows:
    """Equations of motion times the step, projected on the half robot (virtual work)."""
    g = project(model, reduction, dynamics) * h / STEP
    return _defects(g, [f"dynamics:{q.name}" for q in layout.quantities["q"]])


def project(model: Model, reduction: Reduction, dynamics: ca.SX) -> ca.SX:
    """Scaled equations of motion (half n,) [1] of the half robot, by virtual work.

    `dynamics` (n,): the equations of the whole robot [N or N.m].
    """
    scale = [r.scale * (1.0 if r.unit == "N" else ANGLE_ARM) for r in model.node.dynamics_rows]
    B = ca.sparsify(ca.DM(reduction.B["q"]))
    return ca.mtimes(B.T, dynamics / ca.DM(scale))


def _rates(model: Model, reduction: Reduction, rate: ca.SX, h: ca.SX) -> StageRows:
    rows = [model.node.rate_rows[i] for i in reduction.rate]
    g = h * rate[reduction.rate] / ca.DM([r.scale for r in rows]) if rows else ca.SX(0, 1)
    return _defects(g, [r.label for r in rows])


def _signs(g: ca.SX, y: ca.SX, layout: Layout, labels: Sequence[str]) -> StageRows:
    """Rows g >= 0, except where g is a variable whose own bound says so."""
    kept = [i for i in range(g.numel()) if not bounded_below(g[i], y, layout)]
    return StageRows("sign", g[kept], 0.0, INF, [labels[i] for i in kept])


def aim_cost(requirement: Requirement, g: ca.SX) -> ca.SX:
    """The cost of a quantity, here as an expression `g`, that is to be as large or small as
    possible."""
    return ca.densify(-AIM * requirement.aim * g / requirement.scale)


def as_variable(g: ca.SX, y: ca.SX) -> tuple[int, float, float] | None:
    """(index, factor, offset) where g = factor * y[index] + offset, else None."""
    jacobian = ca.jacobian(g, y)
    if jacobian.nnz() != 1 or ca.symvar(jacobian):
        return None
    factor = float(ca.SX(jacobian.nz[0]))
    index = jacobian.sparsity().get_triplet()[1][0]
    offset = float(ca.evalf(ca.substitute(g, y, ca.SX.zeros(y.numel()))))
    return index, factor, offset


def requirement_row(g: ca.SX, requirement: Requirement) -> StageRows:
    """The row of a requirement on the scalar expression g, in its scale."""
    scale = requirement.scale
    low, high = (end / scale for end in (requirement.lower, requirement.upper))
    return StageRows("requirement", g / scale, low, high, [requirement.label])


def tighter_bounds(
    lower: np.ndarray, upper: np.ndarray, factor: float, offset: float, asked: Requirement
) -> tuple[np.ndarray, np.ndarray] | None:
    """Bounds (n,) of variables x by which factor x + offset also is what is asked; equal where they
    cross by rounding only. None where they cross by more: no solver takes such bounds, but a row
    says what is asked."""
    ends = sorted((end - offset) / factor for end in (asked.lower, asked.upper))
    low, high = np.maximum(lower, ends[0]), np.minimum(upper, ends[1])
    if (low - high > ROUNDED).any():
        return None
    crossed = low > high
    low[crossed] = high[crossed] = 0.5 * (low[crossed] + high[crossed])
    return low, high


def bounded_below(g: ca.SX, y: ca.SX, layout: Layout) -> bool:
    """Whether `g`, a scalar, is an entry of `y` (n,) whose own bound says g >= 0."""
    variable = as_variable(g, y)
    if variable is None:
        return False
    index, factor, offset = variable
    return factor > 0 and factor * float(layout.lower[index]) + offset >= 0
