"""The same program with requirements that may give way at an l1 cost; the physics stays hard."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from kemba.model import Model
from kemba.ocp.infeasibility.pose import SCALE
from kemba.ocp.nlp.blocks import Block
from kemba.ocp.nlp.ipopt import Ipopt, Iterate, Parameters
from kemba.ocp.relaxation.guess import automatic_guess
from kemba.ocp.relaxation.schedule import (
    LOOSE,
    SWITCHING,
    VALVE,
    Schedule,
    Stopped,
    fix,
    tighten,
    warm,
)
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.stage import Rows
from kemba.ocp.transcription.symmetry import Reduction
from kemba.ocp.transcription.transcribe import RequirementBlock, Transcription

if TYPE_CHECKING:
    from kemba.ocp.planner import Planner

BUDGET = 30.0  # s
NODES = 40  # a coarser grid is enough to say what is too much
ITERATIONS = 500
PRICE = 100.0  # of one unit of scaled slack, against a cost of 0.01 to 10
SHORT = 0.05  # scaled slack (5 mm, 0.6 deg) from which a requirement counts as out of reach

# Who gives way: goals first, as people would; then everything but the start, whose pose is judged
# before solving.
TIERS = (("goals",), ("goals", "bounds", "end"))


class Elastic(Transcription):
    """Requirements of the sections `soft` have a pair of slack variables, shared by their nodes: how far
    below and above what is asked the plan stays. They stand at the first node, in columns of Y
    behind the layout's.
    """

    def __init__(
        self,
        model: Model,
        task: Task,
        requirements: Sequence[Requirement],
        reduction: Reduction,
        nodes: int,
        soft: Sequence[str],
    ) -> None:
        self.soft = soft
        self.slack: list[tuple[Requirement, int, float]] = []  # requirement, first column, scale
        cheap = {name: 0.01 * weight for name, weight in task.cost.items()}
        super().__init__(
            model, task.model_copy(update={"cost": cheap}), requirements, reduction, nodes
        )

    def extra_columns(self) -> int:
        return 2 * sum(w.location[0] in self.soft for w, _, _ in self.requirement_expressions())

    def requirement_blocks(self, index: np.ndarray) -> list[RequirementBlock]:
        blocks = (
            (self.yielding if requirement.location[0] in self.soft else self.hard)(
                requirement, g, where, index
            )
            for requirement, g, where in self.requirement_expressions()
        )
        return [block for block in blocks if block is not None]

    def yielding(
        self, requirement: Requirement, g: ca.SX, where: list[int], index: np.ndarray
    ) -> RequirementBlock:
        """The rows of a requirement that may give way, at a price per unit of scaled slack."""
        column, scale = self.layout.size + 2 * len(self.slack), requirement_scale(requirement)
        self.slack.append((requirement, column, scale))
        self.upper[0, column : column + 2] = np.inf
        below, above = ca.SX.sym("below"), ca.SX.sym("above")
        rows = Rows(
            "requirement",
            g / scale + below - above,
            requirement.lower / scale,
            requirement.upper / scale,
            (f"{requirement.text}:{requirement.quantity.name}",),
            (requirement.quantity.unit,),
            (scale,),
        )
        shared = np.tile(index[0, column : column + 2], (len(where), 1))
        at = np.hstack([index[where, : self.layout.size], shared])
        price = PRICE * (below + above) / len(where)
        return Block(ca.vertcat(self.stage.y, below, above), rows.g, price, at), rows, where

    def start(self, Y: np.ndarray) -> np.ndarray:
        """A start guess with room for every requirement to give way."""
        wide = np.zeros(self.shape)
        wide[:, : self.layout.size] = Y
        wide[0, self.layout.size :] = 0.1
        return wide

    def given(self, Y: np.ndarray) -> list[tuple[Requirement, float, float]]:
        """Requirements that gave way: the requirement, by how much in its unit (above: positive), and scaled."""
        found = []
        for requirement, column, scale in self.slack:
            by = float(Y[0, column + 1] - Y[0, column])
            found.append((requirement, by * scale, abs(by)))
        return found


def requirement_scale(requirement: Requirement) -> float:
    """What counts as one unit of slack."""
    return SCALE.get(requirement.quantity.unit, requirement.quantity.scale)


@dataclass(frozen=True)
class Outcome:
    """How an elastic solve ended: the program, its last converged point, and what gave way."""

    transcription: Elastic
    point: Iterate
    given: tuple[tuple[Requirement, float, float], ...]

    @property
    def short(self) -> bool:
        """Whether some requirement is out of reach."""
        return bool(self.given)


def elastic(planner: Planner, reduction: Reduction) -> Outcome | None:
    """Solve the task with soft requirements on a coarse grid; None when even that failed.

    Raises Stopped when the user stopped it.
    """
    deadline = min(planner.deadline, time.monotonic() + BUDGET)
    sections = {str(w.location[0]) for w in planner.requirements}
    for soft in TIERS:
        if sections & set(soft):
            outcome = _solve(planner, reduction, soft, deadline)
            if outcome is not None:
                return outcome
    return None


def _solve(
    planner: Planner, reduction: Reduction, soft: Sequence[str], deadline: float
) -> Outcome | None:
    """The usual schedule; the last step that converged counts."""
    task = planner.task
    nodes = min(task.nodes, NODES)
    with planner.building.running():
        program = Elastic(planner.model, task, planner.requirements, reduction, nodes, soft)
    options = {**task.solver.options, "max_iter": ITERATIONS}
    ipopt = Ipopt(
        program, options, planner.log, deadline, planner.watch, planner.stop, planner.building
    )
    search = Schedule(ipopt, task.solver.complementarity, planner.tell, planner.attempts)
    quiet = [w for w in planner.requirements if w.location[0] not in soft]
    converged: list[Iterate] = []
    try:
        name = f"soft {' and '.join(soft)}: relax"
        # the second guess keeps still, which is nearly feasible: far off the bounds it is not
        for requirements, push in ((planner.requirements, 0.3), (quiet, 1e-3)):
            interior = {"bound_push": push, "bound_frac": push, "mu_init": 0.1, "tol": 1e-3}
            Y = automatic_guess(planner.model, task, requirements, program.layout, nodes)
            start = Iterate(program.start(Y))
            point = search.solve(name, start, Parameters(LOOSE), options=interior)
            if point.solved:
                converged.append(point)
                break
        else:
            return None
        binary, name = Parameters(LOOSE, VALVE, SWITCHING), "its valves"
        point = search.solve(name, converged[0], binary, options=warm(1e-3, tol=1e-3))
        converged.append(point)
        converged.append(tighten(search, fix(search, point)))
    except Stopped as stop:
        if stop.point.message == "User_Requested_Stop":
            raise
    best = next((p for p in reversed(converged) if p.solved), None)
    if best is None:
        return None
    return Outcome(program, best, tuple(g for g in program.given(best.Y) if g[2] > SHORT))
