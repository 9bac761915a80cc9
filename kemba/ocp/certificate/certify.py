"""What a written plan really satisfies: residuals measured from the trajectory itself;
and its cost as its task weighs it, to compare plans of one task."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from kemba.model import Model
from kemba.ocp.certificate.asked import MeasuredRequirement, measured
from kemba.ocp.task.costs import running
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import CostTerm, Task, Tolerances
from kemba.ocp.transcription.first_node import state_rows
from kemba.ocp.transcription.solution import arrays
from kemba.ocp.transcription.stage import AIM, ANGLE_ARM, COST_SCALE
from kemba.trajectory import Trajectory

OF_WEIGHT = "of body weight"  # in the unit of a force times its gap


@dataclass(frozen=True)
class Violation:
    """A physical law or a requirement that is violated at a node: by `violation` in `unit`, which
    is `size` times its scale."""

    what: str
    node: int
    time_s: float
    violation: float
    unit: str
    size: float


@dataclass(frozen=True)
class Certificate:
    """Residuals of a plan, its worst violations, worst first, and what the task asks, measured."""

    complementarity: float
    binary: float
    dynamics: float
    bounds: float
    worst: tuple[Violation, ...]
    asked: tuple[MeasuredRequirement, ...] = ()

    @property
    def missed(self) -> tuple[MeasuredRequirement, ...]:
        """The requirements that are not kept, the largest miss first."""
        missed = (measured for measured in self.asked if not measured.met)
        return tuple(sorted(missed, key=lambda m: -m.miss / m.scale))

    def within(self, tolerances: Tolerances) -> bool:
        """Whether every residual is acceptable and every requirement kept; valves must be exactly
        binary."""
        return not self.missed and self.sound(tolerances)

    def sound(self, tolerances: Tolerances) -> bool:
        """Whether the motion obeys its equations and bounds, whatever the task asks of it."""
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
    """Residuals of a trajectory under implicit Euler on its own grid, with the `most` worst.

    complementarity: largest force (by body weight) times gap [m] or slip [m.s-1]; binary: largest
    u(1 - u); dynamics: largest scaled defect; bounds: largest scaled violation of bounds, limits
    and signs, the first node included. Raises KembaError for missing columns.
    """
    of_laws = Measurement(model, trajectory)
    bounds = [of_laws.signs(), of_laws.first_node(), of_laws.boxes()]
    defects = max(of_laws.dynamics(), of_laws.kinematics(), of_laws.rates())
    pairs, binary = of_laws.products(), of_laws.binary()
    asked = measured(model, task, requirements, trajectory)
    worst = sorted((*violations(asked), *of_laws.worst(most)), key=lambda v: -v.size)
    return Certificate(pairs, binary, defects, max(bounds), tuple(worst[:most]), asked)


def violations(asked: Iterable[MeasuredRequirement]) -> tuple[Violation, ...]:
    """The requirements that are not kept, the largest miss first."""
    missed = sorted((m for m in asked if not m.met), key=lambda m: -m.miss / m.scale)
    return tuple(
        Violation(m.text, m.node, m.time_s, m.miss, m.unit, m.miss / m.scale) for m in missed
    )


Label = tuple[str, str, float]  # what a column says, the unit of its violation, one unit's size


class Measurement:
    """The residuals of a trajectory, measured part by part; each part notes its violations.

    Arrays are (nodes, rows) over the nodes from 1 on, where a step ends, unless said otherwise.
    """

    def __init__(self, model: Model, trajectory: Trajectory) -> None:
        self.model, self.trajectory, self.time = model, trajectory, trajectory.time
        self.x = x = arrays(model, trajectory)
        self.h = h = np.diff(trajectory.time)[:, None]
        self.found: list[Violation] = []
        rates = np.diff(x["v"], axis=0) / h, np.diff(x["s"], axis=0) / h
        now = {name: values[1:] for name, values in x.items()}
        at = (now["q"], now["v"], rates[0], now["s"], rates[1], now["lam"], now["u"])
        parts = model.node.residual.map(len(h))(*(m.T for m in at), [])
        names = ("dynamics", "rate", "pair_a", "pair_b", "limits")
        self.residual = {n: np.array(p).T for n, p in zip(names, parts, strict=True)}

    def note(self, values: np.ndarray, labels: Iterable[Label], first: int = 1) -> float:
        """Keep the worst of every column of scaled violations (nodes, rows), whose nodes begin at
        `first`; the largest of all, at least 0."""
        if values.size == 0:
            return 0.0
        for j, (what, unit, scale) in enumerate(labels):
            k = int(np.argmax(values[:, j]))
            size, node = float(values[k, j]), k + first
            time = float(self.time[node])
            self.found.append(Violation(what, node, time, size * scale, unit, size))
        return float(max(values.max(), 0.0))

    def worst(self, most: int) -> tuple[Violation, ...]:
        """The worst violations noted so far, each law once, worst first; not rounding errors."""
        kept: dict[tuple[str, str], Violation] = {}
        for violation in sorted(self.found, key=lambda v: -v.size):
            if violation.size > 1e-9:
                kept.setdefault((violation.what, violation.unit), violation)
        return tuple(kept.values())[:most]

    def dynamics(self) -> float:
        """Equations of motion, forces by body weight and moments by that at an arm."""
        rows, weight = self.model.node.dynamics_rows, self.model.mechanism.weight
        scale = weight * np.array([1.0 if r.unit == "N" else ANGLE_ARM for r in rows])
        labels = [(r.label, r.unit, float(s)) for r, s in zip(rows, scale, strict=True)]
        return self.note(np.abs(self.residual["dynamics"]) / scale, labels)

    def kinematics(self) -> float:
        """Coordinates against velocities times steps."""
        coordinates = self.model.mechanism.coordinates
        defect = np.diff(self.x["q"], axis=0) - self.h * self.x["v"][1:]
        labels = [(f"kinematics:{c.name}", c.unit, c.scale) for c in coordinates]
        return self.note(np.abs(defect) / np.array([c.scale for c in coordinates]), labels)

    def rates(self) -> float:
        """Effect states against their rates times steps."""
        rows = self.model.node.rate_rows
        if not rows:
            return 0.0
        defect = np.abs(self.residual["rate"]) * self.h / np.array([r.scale for r in rows])
        return self.note(defect, [(r.label, r.unit.removesuffix(".s-1"), r.scale) for r in rows])

    def products(self) -> float:
        """Products of the complementarity pairs, forces by body weight."""
        rows = self.model.node.pair_rows
        product = np.abs(self.residual["pair_a"] * self._scaled_b())
        return self.note(product, [(a.label, f"{a.unit} {OF_WEIGHT}", 1.0) for a, _ in rows])

    def signs(self) -> float:
        """Pairs and limits that are negative."""
        node = self.model.node
        first = [(a.label, a.unit, 1.0) for a, _ in node.pair_rows]
        second = [(b.label, b.unit, b.scale) for _, b in node.pair_rows]
        limits = [(r.label, "of the limit", 1.0) for r in node.limit_rows]
        return max(
            self.note(-self.residual["pair_a"], first),
            self.note(-self._scaled_b(), second),
            self.note(-self.residual["limits"], limits),
        )

    def _scaled_b(self) -> np.ndarray:
        scale = np.array([b.scale for _, b in self.model.node.pair_rows])
        return np.asarray(self.residual["pair_b"] / scale)

    def first_node(self) -> float:
        """What holds in every state, at the first node."""
        rows = state_rows(self.model.node)
        if not rows:
            return 0.0
        values = first_state(self.model, *(self.x[name][0] for name in ("q", "v", "s")))
        return self.note(-values[None, :], [(r.label, r.unit, r.scale) for r in rows], 0)

    def boxes(self) -> float:
        """Bounds of every quantity; the first node has no inputs and forces."""
        worst = 0.0
        for name, quantities in self.model.groups.items():
            first = 0 if name in ("q", "v", "s") else 1
            values = self.x[name][first:]
            lower, upper, scale = (
                np.array([getattr(q, end) for q in quantities])
                for end in ("lower", "upper", "scale")
            )
            over = np.maximum(lower - values, values - upper) / scale
            labels = [(f"bound:{q.name}", q.unit, q.scale) for q in quantities]
            worst = max(worst, self.note(over, labels, first))
        return worst

    def binary(self) -> float:
        """Largest u(1 - u) of the valves."""
        valves = [i for i, q in enumerate(self.model.inputs.values()) if q.binary]
        u = self.x["u"][1:, valves]
        return float(np.max(np.abs(u * (1 - u)), initial=0.0))


def first_state(model: Model, q: np.ndarray, v: np.ndarray, s: np.ndarray) -> np.ndarray:
    """What holds in every state (rows,), scaled, at q, v, s (n,); negative where it does not."""
    node, rows = model.node, state_rows(model.node)
    scaled = ca.vertcat(*(row.expression / row.scale for row in rows))
    evaluate = ca.Function("state", [node.q, node.v, node.s], [ca.densify(scaled)])
    return np.array(evaluate(q, v, s)).ravel()


def integral(cost: Mapping[str, float | CostTerm], model: Model, plan: Trajectory) -> float:
    """The time integral of weighted costs over a plan, by its nodes."""
    x, h, node = arrays(model, plan), np.diff(plan.time), model.node
    step = ca.SX.sym("h")
    now = {group: getattr(node, group) for group in model.groups}
    f = ca.Function("cost", [*now.values(), step], [running(model, cost, now, step)])
    return float(ca.sum2(f.map(len(h))(*(x[group][1:].T for group in now), h[None, :])))


def objective(
    model: Model, task: Task, requirements: Sequence[Requirement], plan: Trajectory
) -> float:
    """Weighted costs of a plan, less what is gained by quantities that are to be large or small."""
    return integral(task.cost, model, plan) - sum(gains(requirements, plan).values())


def gains(requirements: Sequence[Requirement], plan: Trajectory) -> dict[str, float]:
    """By how much [N2.m2.s] the cost is lower for each quantity that is to be large or small, by
    the name of its goal and its own."""
    found = {}
    for r in (r for r in requirements if r.aim and r.at is not None):
        value = float(plan[r.quantity.name][r.node(len(plan) - 1)])
        found[f"{r.location[1]} ({r.quantity.name})"] = COST_SCALE * AIM * r.aim * value / r.scale
    return found


def costs(model: Model, plan: Trajectory) -> dict[str, float]:
    """Time integrals of a plan: squared hip torque [N2.m2.s], open valve time [s]."""
    keys = {"torque_squared": "torque_squared_integral", "air": "valve_open_s"}
    return {key: integral({name: 1.0}, model, plan) for name, key in keys.items()}
