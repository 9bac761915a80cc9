"""What a written plan really satisfies: residuals measured from the trajectory itself."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

import casadi as ca
import numpy as np

from kemba.model import Model
from kemba.ocp.task.costs import COSTS
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import Task, Tolerances
from kemba.ocp.transcription.first_node import state_rows
from kemba.ocp.transcription.solution import arrays
from kemba.ocp.transcription.stage import ANGLE_ARM
from kemba.quantity import Quantity
from kemba.trajectory import Trajectory


@dataclass(frozen=True)
class Violation:
    """One violated piece of physics or requirement: `size` is relative to its scale, `violation` in
    `unit`."""

    what: str
    node: int
    time_s: float
    violation: float
    unit: str
    size: float


class Note(Protocol):
    """Records scaled violations (nodes, rows) and returns the largest, at least zero."""

    def __call__(
        self, values: np.ndarray, labels: Iterable[tuple[str, str, float]], first: int = 1
    ) -> float: ...


@dataclass(frozen=True)
class Certificate:
    """Residuals of a plan and its worst violations, worst first."""

    complementarity: float
    binary: float
    dynamics: float
    bounds: float
    worst: tuple[Violation, ...]

    def within(self, tolerances: Tolerances) -> bool:
        """Whether every residual is acceptable; valves must be exactly binary."""
        return (
            self.complementarity <= tolerances.complementarity
            and self.binary == 0.0
            and self.dynamics <= tolerances.dynamics
            and self.bounds <= tolerances.bounds
        )


def certify(
    model: Model,
    task: Task,
    requirements: Sequence[Requirement],
    trajectory: Trajectory,
    most: int = 8,
) -> Certificate:
    """Residuals of a trajectory under implicit Euler on its own grid.

    complementarity: max of force (by body weight) times gap [m] or slip [m.s-1]; dynamics: max
    scaled defect; bounds: max scaled violation of bounds, limits, signs and requirements.
    """
    x, t = arrays(model, trajectory), trajectory.time
    h = np.diff(t)
    node = model.node
    a, sd = np.diff(x["v"], axis=0) / h[:, None], np.diff(x["s"], axis=0) / h[:, None]
    now = {k: values[1:] for k, values in x.items()}
    evaluated = node.residual.map(len(h))(
        *(m.T for m in (now["q"], now["v"], a, now["s"], sd, now["lam"], now["u"])), []
    )
    dynamics, rate, pair_a, pair_b, limits = (np.array(part).T for part in evaluated)
    weight = model.mechanism.weight

    found: list[Violation] = []

    def note(values: np.ndarray, labels: Iterable[tuple[str, str, float]], first: int = 1) -> float:
        """Record scaled violations (nodes, rows); `labels` give what, unit and physical scale."""
        if values.size == 0:
            return 0.0
        for j, (what, unit, scale) in enumerate(labels):
            k = int(np.argmax(values[:, j]))
            size = float(values[k, j])
            found.append(Violation(what, k + first, float(t[k + first]), size * scale, unit, size))
        return float(max(values.max(), 0.0))

    arm = np.array([1.0 if r.unit == "N" else ANGLE_ARM for r in node.dynamics_rows])
    kinematic = np.diff(x["q"], axis=0) - h[:, None] * now["v"]
    q_scale = np.array([c.scale for c in model.mechanism.coordinates])
    s_scale = np.array([r.scale for r in node.rate_rows])
    defect = max(
        note(
            np.abs(dynamics) / (weight * arm),
            [(r.label, r.unit, weight * s) for r, s in zip(node.dynamics_rows, arm, strict=True)],
        ),
        note(
            np.abs(kinematic) / q_scale,
            [(f"kinematics:{c.name}", c.unit, c.scale) for c in model.mechanism.coordinates],
        ),
        note(
            np.abs(rate) * h[:, None] / s_scale if rate.size else rate,
            [(r.label, r.unit.removesuffix(".s-1"), r.scale) for r in node.rate_rows],
        ),
    )
    scale_b = np.array([b.scale for _, b in node.pair_rows])
    product = np.abs(pair_a * pair_b / scale_b)
    pairs = note(product, [(a.label, f"{a.unit} of body weight", 1.0) for a, _ in node.pair_rows])
    signs = max(
        note(-pair_a, [(a.label, a.unit, 1.0) for a, _ in node.pair_rows]),
        note(-pair_b / scale_b, [(b.label, b.unit, b.scale) for _, b in node.pair_rows]),
        note(-limits, [(r.label, "of the limit", 1.0) for r in node.limit_rows]),
    )
    signs = max(signs, _first_node(model, x, note))
    acting = {q.name for q in (*model.inputs.values(), *model.forces.values())}
    boxes = [signs, *_boxes(model, x, note), _requirements(requirements, trajectory, found, acting)]
    binary = [i for i, q in enumerate(model.inputs.values()) if q.binary]
    u = now["u"][:, binary]
    worst = sorted((v for v in found if v.size > 1e-9), key=lambda v: -v.size)[:most]
    return Certificate(
        pairs, float(np.max(np.abs(u * (1 - u)), initial=0.0)), defect, max(boxes), tuple(worst)
    )


def _boxes(model: Model, x: dict[str, np.ndarray], note: Note) -> list[float]:
    groups: dict[str, Iterable[Quantity]] = {
        "q": model.mechanism.coordinates,
        "v": model.mechanism.velocities,
        "s": model.states.values(),
        "u": model.inputs.values(),
        "lam": model.forces.values(),
    }
    sizes = []
    for name, group in groups.items():
        quantities = list(group)
        lower = np.array([q.lower for q in quantities])
        upper = np.array([q.upper for q in quantities])
        scale = np.array([q.scale for q in quantities])
        first = 0 if name in ("q", "v", "s") else 1  # the first node has no inputs and forces
        values = x[name][first:]
        over = np.maximum(lower - values, values - upper) / scale
        labels = [(f"bound:{q.name}", q.unit, q.scale) for q in quantities]
        sizes.append(note(over, labels, first))
    return sizes


def _first_node(model: Model, x: dict[str, np.ndarray], note: Note) -> float:
    """What holds in every state, at the first node."""
    rows = state_rows(model.node)
    if not rows:
        return 0.0
    values = first_state(model, *(x[name][0] for name in ("q", "v", "s")))
    return note(-values[None, :], [(r.label, r.unit, r.scale) for r in rows], 0)


def first_state(model: Model, q: np.ndarray, v: np.ndarray, s: np.ndarray) -> np.ndarray:
    """What holds in every state (rows,), scaled, at q, v, s; negative where it does not."""
    node, rows = model.node, state_rows(model.node)
    scaled = ca.vertcat(*(row.expression / row.scale for row in rows))
    evaluate = ca.Function("state", [node.q, node.v, node.s], [ca.densify(scaled)])
    return np.array(evaluate(q, v, s)).ravel()


def _requirements(
    requirements: Sequence[Requirement],
    trajectory: Trajectory,
    found: list[Violation],
    acting: set[str],
) -> float:
    worst = 0.0
    nodes = len(trajectory) - 1
    for requirement in requirements:
        values = trajectory[requirement.quantity.name]
        over = np.maximum(requirement.lower - values, values - requirement.upper)
        if requirement.at is None and requirement.quantity.name in acting:
            over[0] = 0.0  # inputs and forces act on the interval before a node
        k = int(np.argmax(over)) if requirement.at is None else requirement.node(nodes)
        size = float(over[k]) / requirement.scale
        what = f"{requirement.text}:{requirement.quantity.name}"
        found.append(
            Violation(
                what, k, float(trajectory.time[k]), float(over[k]), requirement.quantity.unit, size
            )
        )
        worst = max(worst, size)
    return worst


def costs(model: Model, trajectory: Trajectory) -> dict[str, float]:
    """Time integrals of the plan: squared hip torque [N2.m2.s], open valve time [s]."""
    u, h = arrays(model, trajectory)["u"][1:], np.diff(trajectory.time)
    symbol, step = ca.SX.sym("u", u.shape[1]), ca.SX.sym("h")
    totals = {}
    for name, key in (("torque_squared", "torque_squared_integral"), ("air", "valve_open_s")):
        f = ca.Function(name, [symbol, step], [COSTS[name](model, symbol, step)])
        totals[key] = float(ca.sum2(f.map(len(h))(u.T, h[None, :])))
    return totals
