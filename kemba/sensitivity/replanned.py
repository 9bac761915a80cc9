"""The plan made anew for a changed figure, to first order, with its phases kept.

The refined plan fulfils the optimality conditions of the multi-phase program. Differentiating them
gives one linear system (KKT matrix) for the derivatives of variables and multipliers by any
figure; it is factorised once. Source: Pirnay, Lopez-Negrete and Biegler 2012 (sIPOPT).

With f, g and multipliers lam, mu, the Lagrangian is L = f + lam g + mu x. A change of a figure
changes its gradient, the rows and the bounds; variables and multipliers answer by

    [ W + S   J^T ] [ dx   ]   [ -d(grad L) + S d(bound of x) ]
    [ J       -D  ] [ dlam ] = [ -d g + d(bound of g)         ]

S = mu / (distance to the bound) is large where a bound of x is active and zero elsewhere;
D = (distance to the bound) / lam is zero for equalities and large where a row is not active.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from kemba.config import Document
from kemba.effects import Effect
from kemba.effects.mechanics.load import Payload
from kemba.errors import KembaError, suggest
from kemba.model import Model
from kemba.ocp.nlp.ipopt import Control, Iterate
from kemba.ocp.phases.modes import Phase, noted_phases
from kemba.ocp.phases.program import PhasePart, PhaseProgram
from kemba.ocp.phases.radau import RADAU5
from kemba.ocp.refinement.refine import Refiner, reduction_of, valve_columns
from kemba.ocp.refinement.start import solve_along, warm
from kemba.ocp.task.resolve import resolve
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.layout import STEP
from kemba.ocp.transcription.stage import COST_SCALE
from kemba.ocp.transcription.symmetry import Reduction
from kemba.ocp.transcription.unilateral import read_constraints
from kemba.trajectory import Trajectory

Vector = np.ndarray


NEAR = 1e-10  # scaled distance from a bound below which it is touched: IPOPT's is 1e-8
OFF = 1e-9  # least multiplier of a row, by which distances are divided: such a row is not active
SOFT = 1e-9  # on the diagonal, against rows that say the same: far below the entries, about one


@dataclass(frozen=True)
class Change:
    """What a change of a figure does to a program at a point, all else kept.

    To the cost f, the gradient of the Lagrangian (n,), the rows g (m,) and all bounds.
    """

    f: float
    gradient: Vector
    g: Vector
    lower: Vector
    upper: Vector
    g_lower: Vector
    g_upper: Vector


def change_between(low: PhaseProgram, high: PhaseProgram, point: Iterate) -> Change | None:
    """The program `high` less `low` at a point, which may have variables of its own behind theirs.

    None where their rows do not correspond.
    """
    assert point.lam_g is not None
    if len(low.parts) != len(high.parts) or len(low.rows) != len(high.rows):
        return None
    x = point.Y[: low.columns.size]
    f, gradient, g, row = 0.0, np.zeros(len(x)), np.zeros(len(low.rows)), 0
    for old, new in zip(low.parts, high.parts, strict=True):
        n, m = len(old.columns), old.g.numel()
        if (n, m) != (len(new.columns), new.g.numel()):
            return None
        rows = slice(row, row + n * m)
        row += n * m
        if _text(old) == _text(new):
            continue
        at = x[old.columns].T, point.lam_g[rows].reshape(n, m).T
        before, after = (_evaluated(part, n)(*at) for part in (old, new))
        cost, value, slope = (np.array(b) - np.array(a) for a, b in zip(before, after, strict=True))
        f += float(cost.sum())
        g[rows] = value.T.ravel()
        np.add.at(gradient, old.columns.ravel(), slope.T.ravel())
    bounds = ("lower", "upper", "g_lower", "g_upper")
    return Change(f, gradient, g, *(_less(getattr(high, b), getattr(low, b)) for b in bounds))


def _text(part: PhasePart) -> str:
    return str(ca.Function("part", [part.z], [part.f, part.g]).serialize())


def _evaluated(part: PhasePart, repeats: int) -> ca.Function:
    """(z, multipliers) -> cost, rows, gradient of the Lagrangian; for all repeats side by side."""
    weights = ca.SX.sym("weights", part.g.numel())
    total = part.f + ca.dot(weights, ca.densify(part.g))
    results = [ca.densify(part.f), ca.densify(part.g), ca.densify(ca.gradient(total, part.z))]
    return ca.Function("part", [part.z, weights], ca.cse(results)).map(repeats)


def _less(high: Vector, low: Vector) -> Vector:
    """The difference; of equal infinite bounds it is 0."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.nan_to_num(high - low))


@dataclass(frozen=True)
class Kkt:
    """The factorised matrix of a solution: `solver` of free variables and rows.

    `free` (n,): variables that may move; `pull` (n,): S; `lam` (m,), `mu` (n,): multipliers;
    `fixed`: columns of W and J of the variables that are fixed; `slope` (n,): gradient of the cost.
    """

    solver: Any
    free: np.ndarray
    pull: Vector
    lam: Vector
    mu: Vector
    fixed: Any
    slope: Vector

    @classmethod
    def of(cls, program: PhaseProgram, point: Iterate) -> Kkt:
        """The system of a program at its solution."""
        from scipy import sparse
        from scipy.sparse.linalg import splu

        assert point.lam_g is not None
        assert point.lam_x is not None
        x, lam, mu = point.Y, point.lam_g, point.lam_x
        problem = program.problem
        half = problem.hess_lag(x, [], 1.0, lam).sparse()
        g, jacobian = problem.jac_g(x, [])
        g, J = np.array(g).ravel(), jacobian.sparse()
        W = half + sparse.triu(half, 1).T
        free = program.lower < program.upper
        pull = np.abs(mu) / np.maximum(_distance(x, mu, program.lower, program.upper), NEAR)
        away = _distance(g, lam, program.g_lower, program.g_upper)
        equal = program.g_lower == program.g_upper
        loose = np.where(equal, SOFT, away / np.maximum(np.abs(lam), OFF) + SOFT)
        both = sparse.vstack([W, J]).tocsc()
        matrix = sparse.bmat(
            [
                [W[free][:, free] + sparse.diags(pull[free] + SOFT), J[:, free].T],
                [J[:, free], -sparse.diags(loose)],
            ]
        )
        slope = np.array(problem.grad_f(x, [])[1]).ravel()
        return cls(splu(matrix.tocsc()), free, pull, lam, mu, both[:, ~free], slope)

    def answer(self, change: Change) -> Vector:
        """The change (n,) of the variables that a change of the program asks for."""
        n, own = len(self.free), len(change.upper)
        more = (0, n - own)  # the program may have proximal variables
        moved = np.pad(np.where(self.mu[:own] > 0, change.upper, change.lower), more)
        bound = np.where(self.lam > 0, change.g_upper, change.g_lower)
        right = np.concatenate(
            [(self.pull * moved - np.pad(change.gradient, more))[self.free], bound - change.g]
        )
        given = self.fixed @ moved[~self.free]
        right -= np.concatenate([given[:n][self.free], given[n:]])
        dx: Vector = moved.copy()
        dx[self.free] = self.solver.solve(right)[: self.free.sum()]
        return dx


def _distance(values: Vector, multiplier: Vector, lower: Vector, upper: Vector) -> Vector:
    """How far values are from the bound that their multiplier is about."""
    return np.asarray(np.abs(np.where(multiplier > 0, upper - values, values - lower)))


Problem = tuple[Task, Model]


# by how much figures change: height and distance [m], supply [Pa], payload [kg], the numbers of
# effects as a share
LENGTH, PRESSURE, MASS, SHARE = 0.01, 10e3, 0.1, 0.1


@dataclass(frozen=True)
class FigureStep:
    """One figure: its value and the `step` by which it changes, in its unit.

    A whole table of an effect has the value 1: it is multiplied by a factor. `machine`: whether it
    is a figure of the machine, so that the same commands give another motion. `at`: task and model
    with another value.
    """

    name: str
    unit: str
    value: float
    step: float
    machine: bool
    at: Callable[[float], Problem]

    def sides(self, share: float = 1.0) -> tuple[Problem, Problem]:
        """Task and model half a step below and half a step above, or a `share` of that."""
        half = 0.5 * share * self.step
        return self.at(self.value - half), self.at(self.value + half)


def figures(task: Task, model: Model, only: Sequence[str] = ()) -> list[FigureStep]:
    """Height or feet, distance, supply, payload, and every number of the model's effects.

    `only`: the names of those that are wanted. Raises KembaError where there is no such figure.
    """
    found = [*_asked(task, model), *_air_and_load(task, model), *_effects(task, model)]
    names = [figure.name for figure in found]
    for name in only:
        if name not in names:
            raise KembaError(task.name, f"no figure '{name}'", hint=suggest(name, names))
    return [figure for figure in found if not only or figure.name in only]


def _asked(task: Task, model: Model) -> Iterator[FigureStep]:
    for name in ("height", "feet", "distance"):
        value = getattr(task, name)
        if value is not None:

            def changed(value: float, name: str = name) -> Problem:
                return task.model_copy(update={name: value}), model

            yield FigureStep(name, "m", float(value), LENGTH, False, changed)


def _air_and_load(task: Task, model: Model) -> Iterator[FigureStep]:

    def fed(pressure: float) -> Problem:
        return task, Model(model.mechanism, model.effects, pressure, model.name)

    def loaded(mass: float) -> Problem:
        return task, model.with_effects([Payload.model_construct(kind="payload", m=mass)])

    yield FigureStep("supply", "Pa", model.supply, PRESSURE, True, fed)
    yield FigureStep("payload", "kg", task.payload, MASS, True, loaded)


def _effects(task: Task, model: Model) -> Iterator[FigureStep]:
    """Numbers by themselves; a table as a factor on all of it."""
    for effect in model.effects:
        if not effect.moves or effect.kind == "payload":
            continue
        numbers = effect.parameters()
        for name in dict.fromkeys([*numbers, *(n.split("[")[0] for n in effect.tolerances())]):
            value, label = effect.value(name), f"{effect.name}.{name}"
            change = _effect_with(task, model, effect, name)
            if isinstance(value, tuple):
                yield FigureStep(label, "1", 1.0, SHARE, True, change)
            elif value:
                step = SHARE * abs(float(value))
                yield FigureStep(label, numbers[name].unit, float(value), step, True, change)


def _effect_with(task: Task, model: Model, effect: Effect, name: str) -> Callable[[float], Problem]:
    old = effect.value(name)

    def change(value: float) -> Problem:
        new = tuple(value * x for x in old) if isinstance(old, tuple) else value
        return task, model.with_effects([effect.bind({name: new})])

    return change


NAN = float("nan")


# proximal weight where the program alone does not converge: a thousandth of the refinement's
PULL = 1e-3
ITERATIONS = 100  # of the solve for the multipliers: twice those of a plan made from another
TOL = 1e-6  # IPOPT's tolerance of that solve: a hundredth of the refinement's
CHANGE = 0.02  # of a step, by which the rows are differenced: above rounding, below any bend


@dataclass(frozen=True)
class Replanned:
    """What one step of a figure changes in the best plan of the same phases.

    `cost` in the task's own weights [N2.m2.s], `duration` and `touchdown` [s], `apex` [m]; NaN
    where there is none.
    """

    cost: float = NAN
    duration: float = NAN
    touchdown: float = NAN
    apex: float = NAN


@dataclass
class PlanProgram:
    """The program of the phases of a refined plan; `built` makes it for any task and model."""

    plan: Trajectory
    reduction: Reduction
    phases: list[Phase]

    @classmethod
    def of(cls, task: Task, model: Model, plan: Trajectory) -> PlanProgram:
        """The program of a plan of a task. Raises KembaError where the plan was not refined."""
        requirements = resolve(task, model, Document(task.model_dump()))
        reduction = reduction_of(model, task, requirements, plan)
        constraints = read_constraints(model, reduction)
        valves = len(valve_columns(model, reduction))
        phases = noted_phases(plan.meta, constraints, valves, len(plan) - 1)
        if phases is None:
            hint = "a plan that was refined has them, see `refine` of the task"
            raise KembaError(task.name, "the plan has no phases", hint=hint)
        return cls(plan, reduction, phases)

    def built(self, task: Task, model: Model) -> tuple[PhaseProgram, np.ndarray]:
        """The program by the finer scheme, and its start (size,) from the plan."""
        requirements = resolve(task, model, Document(task.model_dump()))
        refiner = Refiner(model, task, requirements, self.plan, self.reduction, Control())
        return refiner.build(self.phases, self.plan, RADAU5)


@dataclass
class Solution:
    """The solution of a plan's program, without any proximal term where that converges."""

    source: PlanProgram
    program: PhaseProgram
    point: Iterate

    @cached_property
    def kkt(self) -> Kkt:
        """The factorised system."""
        return Kkt.of(self.program, self.point)


def solution(source: PlanProgram, task: Task, model: Model) -> Solution:
    """A plan's program solved for a task and a model. Raises KembaError where it does not
    converge."""
    options = {**warm(ITERATIONS), "tol": TOL}
    for weight in (0.0, PULL):
        program, x = source.built(task, model)
        if weight:
            x = program.proximal(x, weight)
        point = solve_along(program, Iterate(x), options, Control())
        if point.solved:
            return Solution(source, program, point)
    assert point.ending is not None
    raise KembaError(task.name, f"the plan cannot be solved once more: {point.ending.sentence}")


def of_plan(found: Solution, changed: Sequence[FigureStep]) -> list[Replanned]:
    """For every figure of `changed`, what one step of it changes; see `Replanned`."""
    return [_of_figure(found, figure) for figure in changed]


def _of_figure(found: Solution, figure: FigureStep) -> Replanned:
    low, high = (found.source.built(*side)[0] for side in figure.sides(CHANGE))
    change = change_between(low, high, found.point)
    if change is None:
        return Replanned()
    dx = found.kkt.answer(change)
    times = _times(found.program)
    facts = {name: float(weights @ dx) / CHANGE for name, weights in times.items()}
    cost = (change.f + float(found.kkt.slope @ dx)) * COST_SCALE / CHANGE
    return Replanned(cost=cost, **facts)


def _times(program: PhaseProgram) -> dict[str, np.ndarray]:
    """Duration, touchdown [s] and apex [m] as weights (size,) of the variables."""
    c, phases = program.columns, program.phases

    def until(p: int) -> np.ndarray:
        weights = np.zeros(c.size)
        for before, phase in enumerate(phases[:p]):
            weights[c.h[before, 0]] += phase.elements * STEP
        return weights

    found = {"duration": until(len(phases))}
    landings = [p for p in program.impacts if phases[p].first > program.apex > 0]
    if landings:
        found["touchdown"] = until(landings[0])
    names = [q.name for q in program.layout.quantities["q"]]
    if program.apex and "body/z" in names:
        apex, j = np.zeros(c.size), names.index("body/z")
        apex[c.end(program.apex)["q"][j]] = program.layout.quantities["q"][j].scale
        found["apex"] = apex
    return found
