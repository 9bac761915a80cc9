"""From loose to tight pairs: relaxed programs, each as exact as its relaxation is tight."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from kemba.ocp.mpcc.problem import Mpcc
from kemba.ocp.nlp.ending import Ending
from kemba.ocp.nlp.ipopt import Control, Ipopt, Iterate, warm

LOOSE = 100.0  # the first relaxation, in units of the products: hardly a pair binds
FACTOR = 0.1  # from one relaxation to the next
OFF = 1e-2  # distance of a warm start from bounds, of relaxations above
LONG, BRANCH = 500, 150  # iterations of a relaxed program and of a branch
EXACT = (0.1, 1.0)  # tolerances of a relaxed program, of its relaxation (of its square below one);
# the second where the path of the first comes to an end at an infeasible point
SCALED = {"nlp_scaling_method": "gradient-based", "acceptable_iter": 0}


@dataclass
class Solves:
    """The solves of one program with pairs: what they share, and what they took."""

    program: Mpcc
    control: Control
    options: dict[str, Any]
    tell: Callable[[str], None]
    exact: float = EXACT[0]
    iterations: int = 0
    endings: list[tuple[str, Ending, int]] = field(default_factory=list)

    def relaxed(self, sigma: float, start: Iterate, warmly: bool = True) -> Iterate:
        """The program with products at most `sigma`, solved as far as that is worth."""
        tol = max(1e-8, self.exact * sigma * min(1.0, sigma))
        options = {
            "tol": tol, "compl_inf_tol": tol, "constr_viol_tol": min(1e-4, tol),
            "max_iter": LONG, **(warm(sigma, min(OFF, sigma)) if warmly else {}),
        }  # fmt: skip
        return self._solve(f"relaxed by {sigma:.0e}", self.program.relaxed(sigma), start, options)

    def branch(self, first: np.ndarray, start: Iterate, sigma: float) -> Iterate:
        """The program in which one side of every pair is zero, from a point relaxed by `sigma`."""
        push = min(OFF, sigma)
        options = {"tol": 1e-8, "max_iter": BRANCH, **warm(min(sigma, 1e-4), push)}
        return self._solve("branch", self.program.branch(first), start, options)

    def _solve(self, name: str, rows: Any, start: Iterate, options: dict[str, Any]) -> Iterate:
        self.tell(name)
        ipopt = Ipopt(rows, {**SCALED, **self.options}, self.control)
        found = ipopt.solve(start, self.program.p.tolist(), options)
        self.iterations += found.iterations
        assert found.ending is not None
        self.endings.append((name, found.ending, found.iterations))
        if found.ending.cut_short:
            raise CutShort(found)
        return found


class CutShort(Exception):  # noqa: N818 (a way out, not an error)
    """Raised when the time limit ended a solve; holds its last iterate."""

    def __init__(self, point: Iterate) -> None:
        super().__init__(str(point.ending))
        self.point = point


def tighten(solves: Solves, point: Iterate, sigma: float, last: float) -> Iterate | None:
    """From a point relaxed by `sigma` to one relaxed by `last`; None where a step on the way ends
    at a point that violates least and still violates: tighter pairs would not mend it."""
    while sigma > last * 1.0001:
        sigma = max(last, FACTOR * sigma)
        point = solves.relaxed(sigma, point)
        if point.ending is Ending.INFEASIBLE:
            return None
    return point


def loosest(solves: Solves) -> tuple[Iterate, float]:
    """The first point, with pairs so loose that hardly one binds, and its relaxation."""
    start = solves.program.start
    sigma = LOOSE * max(1.0, solves.program.complementarity(start))
    return solves.relaxed(sigma, Iterate(start), warmly=False), sigma
