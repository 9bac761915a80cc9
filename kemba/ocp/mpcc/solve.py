"""`kemba.solve_mpcc`: a program with complementarity pairs, solved and verified.

From loose to tight pairs: relaxed programs, each as exact as its relaxation is tight.

Strongly stationary: of pairs with both sides zero, neither multiplier pulls a side below zero. No
direction descends then. Where one does, the multipliers may not be the only ones, or another
branch may be cheaper: the linear program with complementarity pairs decides (B-stationarity).
"""

import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from kemba.ocp.mpcc.problem import Mpcc, Symbols
from kemba.ocp.nlp.ending import Ending
from kemba.ocp.nlp.ipopt import Control, Ipopt, Iterate, warm

STEP = 1e-3  # how far the linear program looks, relative to each variable's size
LONGEST = 10.0  # s, of the linear program


@dataclass(frozen=True)
class Multipliers:
    """Of a point on a branch: of the bounds (n,) and rows (rows,), as CasADi signs them, of the
    sides G and H (pairs,), positive where they push the sides up; `residual`: what is left of the
    Lagrangian's gradient, relative to the largest multiplier."""

    lam_x: np.ndarray
    lam_g: np.ndarray
    nu_first: np.ndarray
    nu_second: np.ndarray
    residual: float


def multipliers(program: Mpcc, x: np.ndarray, lam_g: np.ndarray, first: np.ndarray) -> Multipliers:
    """The multipliers at x (n,) on the branch `first` (pairs,), from those of its rows.

    Those of bounds are what the rows leave of the gradient, where a bound or a fixed side can take
    it up: IPOPT does not give them for fixed variables.
    """
    _, gradient = program.problem.grad_f(x, program.p)
    _, jacobian = program.problem.jac_g(x, program.p)
    left = np.array(gradient + ca.mtimes(jacobian.T, lam_g)).ravel()
    rows = program.branch(first)
    near = 1e-6 * (1.0 + np.abs(x))
    low, high = x - rows.lower <= near, rows.upper - x <= near
    takes = (low & (left > 0)) | (high & (left < 0)) | (low & high)
    lam_x = np.where(takes, -left, 0.0)
    size = 1.0 + max(np.max(np.abs(lam_g), initial=0.0), np.max(np.abs(lam_x), initial=0.0))
    m = program.g_rows
    of_sides = lam_g[m : program.problem.rows - program.pairs]
    pushes = -np.concatenate([lam_x, of_sides])
    nu_first, nu_second = pushes[program.a], pushes[program.b]
    residual = float(np.max(np.abs(left + lam_x), initial=0.0) / size)
    return Multipliers(lam_x, lam_g[:m], nu_first, nu_second, residual)


def both_zero(program: Mpcc, x: np.ndarray, near: float) -> np.ndarray:
    """Which pairs have both sides at zero at x (n,), to `near`: (pairs,)."""
    values = program.places(x)
    return np.asarray(np.maximum(values[program.a], values[program.b]) <= near)


def pulled(found: Multipliers, zero: np.ndarray) -> np.ndarray:
    """Which of the pairs `zero` (pairs,) have a side whose multiplier pulls it below zero."""
    size = 1.0 + max(
        np.max(np.abs(found.nu_first), initial=0.0), np.max(np.abs(found.nu_second), initial=0)
    )
    return np.asarray(zero & (np.minimum(found.nu_first, found.nu_second) < -1e-6 * size))


def descending(
    program: Mpcc, x: np.ndarray, first: np.ndarray, zero: np.ndarray
) -> tuple[float, np.ndarray] | None:
    """The steepest descent of the linearised program within STEP of x (n,), over the branches of
    the pairs `zero` (pairs,): the cost's fall and the branch. None where none was found in time."""
    from scipy.optimize import Bounds, LinearConstraint, milp
    from scipy.sparse import csc_matrix, eye, hstack, vstack

    _, gradient = program.problem.grad_f(x, program.p)
    values, jacobian = program.problem.jac_g(x, program.p)
    inside, n, ties = program.problem.rows - program.pairs, program.size, np.flatnonzero(zero)
    rows = jacobian.sparse()[:inside]  # products are left out: sides say them
    at = np.concatenate([x, np.array(values).ravel()[:inside]])
    wide = program.relaxed(np.inf)
    low = np.concatenate([wide.lower, wide.g_lower[:inside]]) - at
    high = np.concatenate([wide.upper, wide.g_upper[:inside]]) - at
    a, b = (place + program.g_rows * (place >= n) for place in (program.a, program.b))
    fixed = np.where(first, a, b)[~zero]
    high[fixed] = -at[fixed]
    low, high = np.minimum(low, 0.0), np.maximum(high, 0.0)  # the point itself is feasible
    reach = STEP * (1.0 + np.abs(x))
    sides = vstack([eye(n, format="csr"), rows]).tocsr()
    big = 1.0 + float((abs(sides) @ reach).max(initial=0.0))
    switch, k = big * eye(len(ties)), len(ties)
    with _quiet():
        found = milp(
            np.concatenate([np.array(gradient).ravel(), np.zeros(k)]),
            integrality=np.repeat([0, 1], [n, k]),
            bounds=Bounds(
                np.concatenate([np.maximum(low[:n], -reach), np.zeros(k)]),
                np.concatenate([np.minimum(high[:n], reach), np.ones(k)]),
            ),
            constraints=[
                LinearConstraint(hstack([rows, csc_matrix((inside, k))]), low[n:], high[n:]),
                LinearConstraint(hstack([sides[a[ties]], -switch]), -np.inf, 0.0),  # a <= big z
                LinearConstraint(
                    hstack([sides[b[ties]], switch]), -np.inf, big
                ),  # b <= big (1 - z)
            ],
            options={"time_limit": LONGEST},
        )
    if found.x is None:
        return None
    branch = first.copy()
    branch[ties] = found.x[n:] < 0.5
    return float(-found.fun), branch


@contextmanager
def _quiet() -> Iterator[None]:
    """No standard output: HiGHS (SciPy 1.15 to 1.17) prints a line where it repairs a point."""
    kept, nothing = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nothing, 1)
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nothing)


# barriers, which lead to different local minima; the first relaxation, in units of the products;
# the tolerance of a relaxed program, of its relaxation (of its square below one)
PATHS = {"adaptive": (1.0, 0.01), "monotone": (100.0, 0.1)}
FACTOR = 0.1  # from one relaxation to the next
OFF = 1e-2  # distance of a warm start from bounds, of relaxations above
LONG, BRANCH = 500, 150  # iterations of a relaxed program and of a branch
SCALED = {"nlp_scaling_method": "gradient-based", "acceptable_iter": 0}


@dataclass
class Solves:
    """The solves of one program with pairs: what they share, and what they took."""

    program: Mpcc
    control: Control
    options: dict[str, Any]
    tell: Callable[[str], None]
    iterations: int = 0

    def relaxed(self, sigma: float, barrier: str, start: Iterate) -> Iterate:
        """The program with products at most `sigma`, solved as far as that is worth."""
        tol = max(1e-8, PATHS[barrier][1] * sigma * min(1.0, sigma))
        options = {
            "tol": tol, "compl_inf_tol": tol, "constr_viol_tol": min(1e-4, tol),
            "max_iter": LONG, "mu_strategy": barrier, "mu_oracle": "quality-function",
            **({} if start.ending is None else warm(sigma, min(OFF, sigma))),
        }  # fmt: skip
        return self._solve(f"relaxed by {sigma:.0e}", self.program.relaxed(sigma), start, options)

    def branch(self, first: np.ndarray, start: Iterate, sigma: float) -> Iterate:
        """The program in which G, where `first` (pairs,), or H is zero, from a relaxed point."""
        push = min(OFF, sigma)
        options = {"tol": 1e-8, "max_iter": BRANCH, **warm(min(sigma, 1e-4), push)}
        return self._solve("branch", self.program.branch(first), start, options)

    def _solve(self, name: str, rows: Any, start: Iterate, options: dict[str, Any]) -> Iterate:
        self.tell(name)
        ipopt = Ipopt(rows, {**SCALED, **self.options}, self.control)
        found = ipopt.solve(start, self.program.p.tolist(), options)
        self.iterations += found.iterations
        if found.ending is not None and found.ending.cut_short:
            raise CutShort(found)
        return found


class CutShort(Exception):  # noqa: N818 (a way out, not an error)
    """Raised when the time limit ended a solve; holds its last iterate."""

    def __init__(self, point: Iterate) -> None:
        super().__init__(str(point.ending))
        self.point = point


TRIED = 1e-6  # relaxation from which a branch is tried; the next is the last
MARGIN = 0.5  # the last relaxation, as a part of the tolerance: room for IPOPT's own
SWITCHES = 5  # branches after the first
PAYS = 1e-7  # relative fall of the cost that makes another branch worth while
SLOPE = 1e-7  # relative fall of the linearised cost below which no direction descends
COMPARED = 1e-2  # relaxation from which costs are exact enough to tell a path that is dearer
WORTH = 1e-4  # relative fall of the cost below which another path is not worth while
RESIDUAL = 1e-5  # of the Lagrangian's gradient at a stationary point


@dataclass(frozen=True)
class MpccSolution:
    """A point and what was verified at it, by the program's own functions.

    `x` (n,), `f`; `multipliers` of bounds, rows and sides; `complementarity`: the largest
    product of a pair; `feasibility`: the largest violation of bounds, rows and signs;
    `stationarity`: strong (multipliers prove it), B (no direction of the linearised program
    descends), none (not shown);
    `status`: solved, feasible, infeasible or time-limit; `iterations` of IPOPT.
    """

    x: np.ndarray
    f: float
    multipliers: Multipliers | None
    complementarity: float
    feasibility: float
    stationarity: str
    status: str
    iterations: int

    def __repr__(self) -> str:
        return f"{type(self).__name__}: {self.sentence}"

    @property
    def good(self) -> bool:
        """Whether the point is feasible and stationary."""
        return self.status == "solved"

    @property
    def sentence(self) -> str:
        """What was found, in words."""
        of = f"violation {self.feasibility:.1e}, products {self.complementarity:.1e}"
        return {
            "solved": f"solved: f = {self.f:.6g}, {self.stationarity}-stationary; {of}",
            "feasible": f"feasible, but not shown to be stationary: f = {self.f:.6g}; {of}",
            "infeasible": f"no feasible point was found near the last one; there: {of}; another "
            "start may help",
            "time-limit": f"the time limit was reached; at the last point: {of}",
        }[self.status]


def solve_mpcc(
    x: Symbols,
    f: Symbols,
    g: Symbols,
    G: Symbols,
    H: Symbols,
    bounds: Mapping[str, Any],
    start: Any,
    p: tuple[Symbols, Any] | None = None,
    *,
    tolerance: float = 1e-6,
    time_limit: float = np.inf,
    options: Mapping[str, Any] | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> MpccSolution:
    """Solve min f(x), lbg <= g(x) <= ubg, lbx <= x <= ubx, 0 <= G(x), 0 <= H(x), G(x) H(x) = 0.

    `x` (n,): CasADi's SX or MX symbols; `f`, `g` (rows,), `G`, `H` (pairs,): expressions of x
    and p.
    `bounds`: lbx, ubx, lbg, ubg, vectors or one number; what is missing is free. `start` (n,); `p`:
    symbols and their values. `tolerance` of what is verified: violations and products. `options` go
    to IPOPT, `progress` gets the name of every solve, `time_limit` [s].

    The pairs are relaxed, G H <= sigma, from so loose that hardly one binds to tight (Scholtes,
    SIAM J. Optim. 11, 2001); then one side of every pair is zero, which is an ordinary program,
    and the products are exact. Where pairs have both sides at zero, multipliers or the linear
    program with pairs say whether another branch descends, which is then taken. Two such paths are
    taken, with different barriers, and the cheaper point is kept; the second ends early where its
    relaxed cost is not below the first's. Local minima may be found, as by every method of this
    kind.

    Raises KembaError for parts that do not fit each other or are no numbers, and for bounds that
    are empty; a program that has no solution is no mistake: `status` says it.
    """
    program = Mpcc(x, f, g, G, H, bounds, start, p)
    deadline = time.monotonic() + time_limit
    solves = Solves(program, Control(deadline=deadline), dict(options or {}), progress)
    found: Found = Iterate(program.start), None
    try:
        for barrier in PATHS:
            found = _along(solves, barrier, found, tolerance)
    except CutShort as cut:
        if found[1] is None:
            return replace(_judged(solves, cut.point, None, tolerance), status="time-limit")
    return _judged(solves, *found, tolerance)


@dataclass(frozen=True)
class OnBranch:
    """A branch (pairs,), the multipliers of its solution, and how stationary that is."""

    first: np.ndarray
    multipliers: Multipliers
    stationarity: str


Found = tuple[Iterate, OnBranch | None]


def _along(solves: Solves, barrier: str, best: Found, tolerance: float) -> Found:
    """The cheaper of `best` and the first feasible point on a path from loose to tight pairs.

    The path ends where its relaxed cost, which tighter pairs raise as a rule, is not below the best
    one, and at a point that violates least and still violates: tighter pairs would not mend it.
    """
    program, point = solves.program, Iterate(solves.program.start)
    enough = best[0].objective - WORTH * _size(best[0]) if best[1] else np.inf
    last = MARGIN * tolerance
    for sigma in _relaxations(program, PATHS[barrier][0], last):
        point = solves.relaxed(sigma, barrier, point)
        dear = sigma <= COMPARED and point.solved and point.objective > enough
        if dear or point.ending is Ending.INFEASIBLE:
            break
        if sigma in (TRIED, last):
            found = _best_branch(solves, point, sigma, tolerance)
            if found is not None:
                return found if found[0].objective < enough else best
    return best if best[1] is not None else (point, None)


def _relaxations(program: Mpcc, loose: float, last: float) -> list[float]:
    """Bounds of the products, from so loose that hardly one binds to `last`."""
    sigma, all_ = loose * max(1.0, program.complementarity(program.start)), []
    for end in (max(TRIED, last), last):
        while sigma > end * 1.0001:
            all_.append(sigma)
            sigma = max(end, FACTOR * sigma)
    return [*all_, last]


def _best_branch(
    solves: Solves, point: Iterate, sigma: float, tolerance: float
) -> tuple[Iterate, OnBranch] | None:
    """The branch nearest to a relaxed point, and better ones from there on; None where it is
    infeasible."""
    program = solves.program
    values = program.places(point.Y)
    first = values[program.a] <= values[program.b]
    best: tuple[Iterate, OnBranch] | None = None
    for _ in range(SWITCHES + 1):
        found = solves.branch(first, point, sigma)
        dearer = best and found.objective > best[0].objective - PAYS * _size(best[0])
        if dearer or not found.solved or _violation(program, found.Y) > tolerance:
            return best
        on, other = _stationary(program, found, first, tolerance)
        best = found, on
        if other is None:
            return best
        point, first, sigma = found, other, 1e-6
    return best


def _stationary(
    program: Mpcc, found: Iterate, first: np.ndarray, tolerance: float
) -> tuple[OnBranch, np.ndarray | None]:
    """How stationary a branch's solution is; and a branch that descends, where there is one."""
    assert found.lam_g is not None
    of = multipliers(program, found.Y, found.lam_g, first)
    zero = both_zero(program, found.Y, tolerance)
    if of.residual <= RESIDUAL and not pulled(of, zero).any():
        return OnBranch(first, of, "strong"), None
    answer = descending(program, found.Y, first, zero)
    if answer is None:
        return OnBranch(first, of, "none"), None
    fall, other = answer
    if fall <= SLOPE * _size(found):
        return OnBranch(first, of, "B"), None
    return OnBranch(first, of, "none"), None if np.array_equal(first, other) else other


def _size(point: Iterate) -> float:
    return max(1.0, abs(point.objective))


def _violation(program: Mpcc, x: np.ndarray) -> float:
    return max(program.feasibility(x), program.complementarity(x))


def _judged(solves: Solves, point: Iterate, on: OnBranch | None, tolerance: float) -> MpccSolution:
    """What holds at a point, whatever the solver said."""
    program, x = solves.program, point.Y
    stationarity = on.stationarity if on else "none"
    feasible = _violation(program, x) <= tolerance
    status = ("solved" if stationarity != "none" else "feasible") if feasible else "infeasible"
    return MpccSolution(
        x, float(program.at(x)[0][0]), on.multipliers if on else None,
        program.complementarity(x), program.feasibility(x), stationarity, status,
        solves.iterations,
    )  # fmt: skip
