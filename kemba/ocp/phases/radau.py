"""Radau IIA collocation of one element and an inelastic impact, as scaled rows of the residual."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.polynomial import legendre

from kemba.model import Model
from kemba.ocp.task.costs import running
from kemba.ocp.task.requirement import SCALES
from kemba.ocp.task.task import CostTerm
from kemba.ocp.transcription.layout import GROUPS, STEP, Layout
from kemba.ocp.transcription.stage import COST_SCALE, project
from kemba.ocp.transcription.symmetry import Reduction

STATE = ("q", "v", "s")


@dataclass(frozen=True)
class Scheme:
    """Radau IIA: stage times within an element, the last one its end, and Butcher's matrix."""

    points: np.ndarray
    butcher: np.ndarray

    @property
    def stages(self) -> int:
        """Number of collocation points of an element."""
        return len(self.points)

    @cached_property
    def slopes(self) -> np.ndarray:
        """D (stages, stages) in h y'_i = sum_j D[i, j] (y_j - y_0)."""
        return np.linalg.inv(self.butcher)


def radau(stages: int) -> Scheme:
    """Radau IIA of order 2 stages - 1: the zeros of P_(stages - 1) - P_stages, moved to (0, 1]
    (Hairer and Wanner, Solving Ordinary Differential Equations II, section IV.5)."""
    points = (np.sort(legendre.legroots([0.0] * (stages - 1) + [1.0, -1.0])) + 1.0) / 2.0
    points[-1] = 1.0
    powers = np.arange(stages)[:, None]
    integrals = points ** (powers + 1) / (powers + 1)
    return Scheme(points, np.linalg.solve(points**powers, integrals).T)


RADAU3, RADAU5, RADAU9 = radau(2), radau(3), radau(5)


@dataclass(frozen=True)
class ScaledRows:
    """Rows g = 0 of the scaled variables z, with their labels, and a cost f."""

    z: ca.SX
    g: ca.SX
    labels: tuple[str, ...]
    f: ca.SX


def width(layout: Layout, group: str) -> int:
    """Number of columns of a group."""
    part = layout.slices[group]
    return int(part.stop - part.start)


def scaled(layout: Layout, group: str, name: str) -> ca.SX:
    """Symbols (width,) of a group's scaled half values [1]."""
    return ca.SX.sym(name, width(layout, group))


def node_vector(layout: Layout, parts: dict[str, ca.SX]) -> ca.SX:
    """A layout vector with groups that are left out at zero."""
    zero = {g: ca.SX.zeros(width(layout, g)) for g in GROUPS}
    return ca.vertcat(*({**zero, **parts}[g] for g in GROUPS))


def element(
    model: Model,
    layout: Layout,
    reduction: Reduction,
    cost: Mapping[str, float | CostTerm],
    scheme: Scheme,
    gaps: Sequence[ca.SX],
) -> ScaledRows:
    """The collocation of one element in z = [x0, (x, lam) per stage, drift, u, h], x = [q, v, s];
    `gaps`: of the node's coordinates, those that may close.

    Closed gaps are held by their rates, and discretised they drift by micrometres. `drift`, one
    for each gap, moves the coordinates along its gradient so that it stays zero at the end
    (Gear, Leimkuhler and Gupta, J. Comput. Appl. Math. 12-13, 1985).
    """
    x0 = {g: scaled(layout, g, f"{g}0") for g in STATE}
    stages = [
        {g: scaled(layout, g, f"{g}{i + 1}") for g in (*STATE, "lam")} for i in range(scheme.stages)
    ]
    u, h_scaled = scaled(layout, "u", "u"), scaled(layout, "h", "h")
    shared = {"u": u, "h": h_scaled}
    at = [node_vector(layout, {**stage, **shared}) for stage in stages]
    start = node_vector(layout, {**x0, **shared})
    h, read = layout.half(start, "h"), layout.reader(model.node, start)
    drift = ca.SX.sym("drift", len(gaps))
    normals = ca.jacobian(ca.vertcat(*(read(gap) for gap in gaps)) / SCALES["m"], x0["q"])
    corrected = ca.mtimes(normals.T, drift)

    def slope(i: int, group: str, view: str) -> ca.SX:
        read = getattr(layout, view)
        before = read(start, group)
        terms = (d * (read(y, group) - before) for d, y in zip(scheme.slopes[i], at, strict=True))
        return ca.SX(sum(terms, ca.SX(0)))

    q_scale, s_rows = [c.scale for c in layout.quantities["q"]], model.node.rate_rows
    rows, labels = [], []
    for i in range(scheme.stages):
        now = {g: layout.full(at[i], g) for g in ("q", "v", "s", "u", "lam")}
        dynamics, rate, _, _, _ = model.node.residual.call(
            [
                now["q"], now["v"], slope(i, "v", "full") / h, now["s"],
                slope(i, "s", "full") / h, now["lam"], now["u"], ca.SX(0, 1),
            ]
        )  # fmt: skip
        moved = (slope(i, "q", "half") - h * layout.half(at[i], "v")) / ca.DM(q_scale)
        rows.append(moved - corrected)
        labels += [f"kinematics:{c.name}" for c in layout.quantities["q"]]
        rows.append(project(model, reduction, dynamics) * h / STEP)
        labels += [f"dynamics:{c.name}" for c in layout.quantities["q"]]
        kept = reduction.rate
        if kept:
            rows.append(h * rate[kept] / ca.DM([s_rows[j].scale for j in kept]))
            labels += [s_rows[j].label for j in kept]
    # the quadrature of the scheme: exact for the polynomials through its points
    points = np.array(scheme.points)
    share = np.linalg.solve(np.vander(points, increasing=True).T, 1 / np.arange(1, len(points) + 1))
    each = ({g: layout.full(y, g) for g in ("q", "v", "s", "u", "lam")} for y in at)
    f = (
        sum(w * running(model, cost, now, h) for w, now in zip(share, each, strict=True))
        / COST_SCALE
    )
    parts = [
        *x0.values(),
        *(part for stage in stages for part in stage.values()),
        drift,
        u,
        h_scaled,
    ]
    return ScaledRows(ca.vertcat(*parts), ca.vertcat(*rows), tuple(labels), ca.densify(ca.SX(f)))


def impact(model: Model, layout: Layout, reduction: Reduction) -> ScaledRows:
    """M (v+ - v-) = B impulse, from the residual's own inertia and force directions, in
    z = [x before, v after, impulses / STEP]."""
    x = {g: scaled(layout, g, g) for g in STATE}
    after, impulse = scaled(layout, "v", "v_after"), scaled(layout, "lam", "impulse")
    before = node_vector(layout, x)
    later = node_vector(layout, {**x, "v": after, "lam": impulse})
    q, s = layout.full(before, "q"), layout.full(before, "s")
    u, rest = ca.SX.zeros(model.node.u.numel()), ca.SX.zeros(model.node.v.numel())
    change = (layout.full(later, "v") - layout.full(before, "v")) / STEP
    lam = layout.full(later, "lam")

    def dynamics(a: ca.SX, forces: ca.SX) -> ca.SX:
        fixed = [s, ca.SX.zeros(s.numel()), forces, u, ca.SX(0, 1)]
        return model.node.residual.call([q, rest, a, *fixed])[0]

    g = dynamics(change, lam) - dynamics(rest, ca.SX.zeros(lam.numel()))
    labels = tuple(f"impact:{c.name}" for c in layout.quantities["q"])
    z = ca.vertcat(*x.values(), after, impulse)
    return ScaledRows(z, project(model, reduction, g), labels, ca.SX(0))
