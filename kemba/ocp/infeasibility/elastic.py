"""The same program with requirements that may be violated at an l1 cost; the physics must hold."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from kemba.model import Model
from kemba.ocp.functions.blocks import RowBlock
from kemba.ocp.nlp.ending import Ending
from kemba.ocp.nlp.ipopt import Iterate, warm
from kemba.ocp.relaxation.guess import automatic_guess
from kemba.ocp.relaxation.schedule import fix, interior, tighten
from kemba.ocp.relaxation.session import Schedule, Session, Stopped
from kemba.ocp.relaxation.settings import Ends, Relaxation, Starts
from kemba.ocp.task.costs import scaled
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import Landing, Task
from kemba.ocp.transcription.stage import requirement_row
from kemba.ocp.transcription.symmetry import Reduction
from kemba.ocp.transcription.transcribe import Parameters, RequirementBlock, Transcription

# What may be violated: goals first; then everything but the start, which is checked before solving.
TIERS = (("goals",), ("goals", "bounds", "end", "clearance"))

BUDGET = 30.0  # s; a user waits no longer for an explanation
ITERATIONS = 500  # of one solve: bounded, since it only explains
CHEAP = 0.01  # factor on the task's costs: far below the price of slack
ROOM = 0.1  # scaled slack of the start guess: off the bounds, in the range of answers


NODES = 40  # of its grid at most; a coarse one is enough to say what is too much
PRICE = 100.0  # of one unit of scaled slack: above every cost of the task, so no violation pays
# scaled slack (5 mm, 0.6 deg) from which a requirement is out of reach: above the grid's own error
SHORT = 0.05


class Elastic(Transcription):
    """A transcription whose requirements of the sections `soft` may be violated.

    Each of them has two slack variables, shared by all its nodes: how far the plan stays below and
    above what is asked. They stand in row 0 of Y, in columns behind the layout's.
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
        cheap = scaled(task.cost, CHEAP)
        super().__init__(
            model, task.model_copy(update={"cost": cheap}), requirements, reduction, nodes
        )

    def extra_columns(self) -> int:
        return 2 * sum(w.location[0] in self.soft for w, _, _ in self.requirement_expressions())

    def requirement_blocks(self, index: np.ndarray) -> list[RequirementBlock]:
        """Rows of every requirement: exact, or with slack where it is soft.

        `index` (nodes + 1, n): position of each node's variables in the full vector.
        """
        blocks = (
            (self.yielding if asked[0].location[0] in self.soft else self.hard)(*asked, index)
            for asked in self.requirement_expressions()
        )
        return [block for block in blocks if block is not None]

    def yielding(
        self, requirement: Requirement, g: ca.SX, where: list[int], index: np.ndarray
    ) -> RequirementBlock:
        """The rows of a requirement that may be violated, at a price per unit of scaled slack.

        `g`: a scalar expression. `where`: the nodes at which it holds. `index` (nodes + 1, n): as
        above.
        """
        column, scale = self.layout.size + 2 * len(self.slack), requirement.scale
        self.slack.append((requirement, column, scale))
        self.upper[0, column : column + 2] = np.inf
        below, above = ca.SX.sym("below"), ca.SX.sym("above")
        rows = replace(requirement_row(g, requirement), g=g / scale + below - above)
        shared = np.tile(index[0, column : column + 2], (len(where), 1))
        z, _, _, at = self.local(requirement, rows.g, where, index)
        price = PRICE * (below + above) / len(where)
        z, at = ca.vertcat(z, below, above), np.hstack([at, shared])
        return RowBlock(z, rows.g, price, at), rows, where

    def start(self, Y: np.ndarray) -> np.ndarray:
        """A start guess with slack for every soft requirement.

        `Y` (nodes + 1, n): scaled variables; the result has the columns of the slack as well.
        """
        wide = np.zeros(self.shape)
        wide[:, : self.layout.size] = Y
        wide[0, self.layout.size :] = ROOM
        return wide

    def given(self, Y: np.ndarray) -> list[tuple[Requirement, float, float]]:
        """Every soft requirement, and its violation in its unit (above is positive) and scaled [1].

        `Y` (nodes + 1, n + slack): scaled variables.
        """
        each = ((r, float(Y[0, k + 1] - Y[0, k]), scale) for r, k, scale in self.slack)
        return [(requirement, by * scale, abs(by)) for requirement, by, scale in each]


@dataclass(frozen=True)
class Outcome:
    """How an elastic solve ended: the program, its last converged point, and what it violated."""

    transcription: Elastic
    point: Iterate
    given: tuple[tuple[Requirement, float, float], ...]

    @property
    def short(self) -> bool:
        """Whether some requirement is out of reach."""
        return bool(self.given)


def elastic(
    model: Model,
    task: Task,
    requirements: Sequence[Requirement],
    reduction: Reduction,
    session: Session,
) -> Outcome | None:
    """Solve the task with soft requirements on a coarse grid; None when even that failed. Raises
    Stopped when the user stopped it."""
    deadline = min(session.control.deadline, time.monotonic() + BUDGET)
    limited = replace(session, control=replace(session.control, deadline=deadline))
    sections = {str(w.location[0]) for w in requirements}
    nodes = min(task.nodes, NODES)
    found: Outcome | None = None
    for posed, soft in _tiers(task):
        if not sections & set(soft):
            continue
        # the clearance holds in the flight that the goal asks for; a lower goal has a shorter one
        asked = [w for w in requirements if w.location[0] != "clearance" or "clearance" in soft]
        with session.building.running():
            program = Elastic(model, posed, asked, reduction, nodes, soft)
        found = _solve(program, limited) or found
        whole = posed is task and len(asked) == len(requirements)
        if found is not None and (found.short or whole):
            break
    return found


def _tiers(task: Task) -> Iterator[tuple[Task, Sequence[str]]]:
    """The task and what of it may be violated, one solve after the other.

    Goals are relaxed without a bound on impacts first: with it the solver often stops at a height
    far below the greatest.
    """
    if task.landing.impact_speed is not None:
        yield task.model_copy(update={"landing": Landing()}), TIERS[0]
    for soft in TIERS:
        yield task, soft


def _solve(program: Elastic, session: Session) -> Outcome | None:
    """The usual schedule; the last step that converged counts."""
    options = {**program.task.solver.options, "max_iter": ITERATIONS}
    schedule = session.schedule(program, options)
    converged: list[Iterate] = []
    try:
        first = _first(schedule, program)
        if first is None:
            return None
        converged.append(first)
        parameters = Parameters(Relaxation.loose, Relaxation.valve, Relaxation.switching)
        how = warm(Starts.changed_mu, tol=Ends.tol)
        point = schedule.solve("its valves", first, parameters, options=how)
        converged.append(point)
        converged.append(tighten(schedule, fix(schedule, point)))
    except Stopped as stop:
        if stop.point.ending is Ending.INTERRUPTED:
            raise
    best = next((p for p in reversed(converged) if p.solved), None)
    if best is None:
        return None
    return Outcome(program, best, tuple(g for g in program.given(best.Y) if g[2] > SHORT))


def _first(schedule: Schedule, program: Elastic) -> Iterate | None:
    """The program with relaxed pairs, from two guesses; None where neither converges.

    The second guess keeps still, which is nearly feasible: far off the bounds it is not.
    """
    name = f"soft {' and '.join(program.soft)}: relax"
    still = [w for w in program.requirements if w.location[0] not in program.soft]
    guesses = ((program.requirements, Starts.interior_push), (still, Starts.changed))
    for requirements, push in guesses:
        Y = automatic_guess(
            program.model, program.task, requirements, program.layout, program.nodes
        )
        start, loose = Iterate(program.start(Y)), Parameters(Relaxation.loose)
        point = schedule.solve(name, start, loose, options=interior(push))
        if point.solved:
            return point
    return None
