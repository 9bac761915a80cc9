"""Poses: can the requirements at one moment hold together, and which of them must be relaxed?"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from kemba.model import Model
from kemba.ocp.task.requirement import Requirement, quantity_expression

STILL = 1e-6  # weight of squared rates, so that they are determined
SPREAD = 3.0  # standard deviation of further starts, times the scale of a coordinate


TRIES = 4  # starts: the standing pose and three others
MET = 1e-5  # SI; slack below which a requirement is met: 10 times the certificate's tolerance


def silent() -> dict[str, Any]:
    """Options of IPOPT for a pose."""
    return {
        "print_time": False,
        "error_on_fail": False,
        "inputs_check": False,  # CasADi would print that a pose has more equalities than variables
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.tol": 1e-8,
        "ipopt.max_iter": 150,
        "ipopt.bound_relax_factor": 0.0,
    }


@dataclass(frozen=True)
class Gap:
    """A requirement, and the nearest value that a pose reaches while the others hold."""

    requirement: Requirement
    asked: float
    reachable: float


class Poses:
    """Poses and rates (q, v) of a model: joints within their range, pistons within their stroke,
    feet not below the ground. `requirements` on other quantities are ignored.
    """

    def __init__(self, model: Model, requirements: Iterable[Requirement]) -> None:
        self.model = model
        node = model.node
        others = ca.vertcat(node.a, node.s, node.sd, node.lam, node.u)
        self.expressions: dict[str, ca.SX] = {}
        self.scales = {w.quantity.name: w.scale for w in requirements}
        for name in self.scales:
            expression = quantity_expression(model, name)
            if not ca.depends_on(expression, others):
                self.expressions[name] = expression
        self.names = list(self.expressions)

    @cached_property
    def walls(self) -> ca.SX:
        """Expressions, a vector, that no pose makes negative: gaps of feet [m], distances to the
        end stops [m]."""
        node = self.model.node
        others = ca.vertcat(node.v, node.a, node.s, node.sd, node.lam, node.u)
        rows = ca.vertsplit(ca.vertcat(node.pair_a, node.pair_b))
        return ca.vertcat(*(r for r in rows if not ca.depends_on(r, others) and r.nnz()))

    @cached_property
    def _solver(self) -> ca.Function:
        node, n = self.model.node, len(self.names)
        below, above, weight = (ca.SX.sym(name, n) for name in ("below", "above", "weight"))
        lift = ca.SX.sym("lift")
        height = quantity_expression(self.model, "body/z")
        aims = ca.vertcat(*self.expressions.values())
        nlp = {
            "x": ca.vertcat(node.q, node.v, below, above),
            "p": ca.vertcat(weight, lift),
            "f": ca.dot(weight, below + above) - lift * height + STILL * ca.sumsqr(node.v),
            "g": ca.vertcat(aims + below - above, self.walls),
        }
        return ca.nlpsol("pose", "ipopt", nlp, silent())

    def gaps(
        self, requirements: Sequence[Requirement], free: Iterable[Requirement]
    ) -> list[Gap] | None:
        """By how much `free` must be relaxed so that all of `requirements` can hold.

        [] when they hold unrelaxed, None when relaxing these does not help.
        """
        may = {w.quantity.name for w in free}
        best: tuple[np.ndarray, np.ndarray] | None = None
        for attempt in range(TRIES):
            found = self._solve(requirements, may, attempt)
            if found is not None:
                slack = found[1]
                if best is None or np.abs(slack).sum() < np.abs(best[1]).sum():
                    best = found
                if np.abs(slack).max(initial=0.0) < MET:
                    return []
        return None if best is None else self._told(best[1], requirements)

    def highest(self, requirements: Sequence[Requirement]) -> float | None:
        """The largest height of the body [m] in any pose in which `requirements` hold."""
        found = [self._solve(requirements, set(), k, lift=1.0) for k in range(TRIES)]
        names = [c.name for c in self.model.mechanism.coordinates]
        heights = [float(f[0][names.index("body/z")]) for f in found if f is not None]
        return max(heights) if heights else None

    def limits(self, requirements: Sequence[Requirement]) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper limit (names,) of every quantity, in its unit, that `requirements`
        leave."""
        lower, upper = np.full(len(self.names), -np.inf), np.full(len(self.names), np.inf)
        for requirement in (w for w in requirements if w.quantity.name in self.names):
            i = self.names.index(requirement.quantity.name)
            lower[i], upper[i] = max(lower[i], requirement.lower), min(upper[i], requirement.upper)
        return lower, upper

    def _solve(
        self, requirements: Sequence[Requirement], may: set[str], attempt: int, lift: float = 0.0
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """(q and v, slack per quantity: positive where the pose lies above what is asked)."""
        mechanism, n, walls = self.model.mechanism, len(self.names), self.walls.numel()
        lower, upper = self.limits(requirements)
        boxes = [*mechanism.coordinates, *mechanism.velocities]
        low, high = np.array([q.lower for q in boxes]), np.array([q.upper for q in boxes])
        asked = {w: (a, b) for w, a, b in zip(self.names, lower, upper, strict=True)}
        near = np.transpose([asked.get(q.name, (-np.inf, np.inf)) for q in boxes])
        start = np.clip(np.clip(self._start(attempt), *near), low, high)
        room = np.array([10.0 * (name in may) for name in self.names])
        weight = [1.0 / self.scales[name] for name in self.names]
        found = self._solver(
            x0=np.concatenate([start, np.full(2 * n, 0.01)]),
            p=[*weight, lift],
            lbx=np.concatenate([low, np.zeros(2 * n)]),
            ubx=np.concatenate([high, room, room]),
            lbg=np.concatenate([lower, np.zeros(walls)]),
            ubg=np.concatenate([upper, np.full(walls, np.inf)]),
        )
        if not self._solver.stats()["success"]:
            return None
        x = np.array(found["x"]).ravel()
        first = len(boxes)
        return x[:first], x[first + n :] - x[first : first + n]

    def _start(self, attempt: int) -> np.ndarray:
        """The standing pose at rest, then others around it."""
        mechanism, rng = self.model.mechanism, np.random.default_rng(attempt)
        q = np.array([mechanism.standing[c.name] for c in mechanism.coordinates])
        away = rng.normal(size=len(q)) * [SPREAD * c.scale for c in mechanism.coordinates]
        return np.concatenate([q + away * (attempt > 0), np.zeros(len(q))])

    def _told(self, slack: np.ndarray, requirements: Sequence[Requirement]) -> list[Gap]:
        gaps = []
        for i, name in enumerate(self.names):
            if abs(slack[i]) < MET:
                continue
            same = [w for w in requirements if w.quantity.name == name]
            low, high = max(same, key=lambda w: w.lower), min(same, key=lambda w: w.upper)
            requirement, asked = (high, high.upper) if slack[i] > 0 else (low, low.lower)
            gaps.append(Gap(requirement, asked, asked + float(slack[i])))
        return gaps
