"""The methods that benchmarks/nosbench.py compares, by the same functions of the same programs."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from kemba.ocp.mpcc.problem import Mpcc, MpccRows, SparseFunctions
from kemba.ocp.mpcc.solve import solve_mpcc
from kemba.ocp.nlp.ipopt import Ipopt, Iterate

SIGMAS = [10.0**-k for k in range(10)]
GOOD = 1e-6


def program_of(given: dict[str, Any]) -> Mpcc:
    """The program of a file."""
    return Mpcc(*(given[name] for name in ("x", "f", "g", "G", "H", "bounds", "start", "p")))


def judged(given: dict[str, Any], x: np.ndarray) -> dict[str, float]:
    """Cost, violation and products at x (n,)."""
    program = program_of(given)
    return {"f": float(program.at(x)[0][0]), "violation": program.feasibility(x),
            "products": program.complementarity(x)}  # fmt: skip


@dataclass(frozen=True)
class Written:
    """The program as it is usually written: G >= 0, H >= 0 and G H <= sigma are rows."""

    program: Mpcc
    problem: SparseFunctions

    def relaxed(self, sigma: float) -> MpccRows:
        of, m = self.program, np.ones(self.program.pairs)
        low, high = (np.concatenate([of.lbg, 0 * m, 0 * m, -np.inf * m]),
                     np.concatenate([of.ubg, np.inf * m, np.inf * m, sigma * m]))  # fmt: skip
        return MpccRows(self.problem, of.lbx, of.ubx, low, high)


def written(given: dict[str, Any]) -> Written:
    """The same program with every side as a row."""
    rows = ca.vertcat(given["g"], given["G"], given["H"], given["G"] * given["H"])
    return Written(program_of(given), SparseFunctions(given["x"], given["p"][0], given["f"], rows))


def plain(given: dict[str, Any]) -> tuple[np.ndarray, int]:
    """Products at most 1, 0.1 and so on to 1e-9, each solved by IPOPT to its own tolerance with the
    adaptive barrier, from the last. Of points with small products, the last that is feasible."""
    program, point = written(given), Iterate(program_of(given).start)
    best, iterations = point.Y, 0
    options = {"mu_strategy": "adaptive", "mu_oracle": "quality-function", "max_iter": 500,
               "nlp_scaling_method": "gradient-based", "bound_relax_factor": 0.0}  # fmt: skip
    for k, sigma in enumerate(SIGMAS):
        more = {"warm_start_init_point": "yes"} if k else {}
        ipopt = Ipopt(program.relaxed(sigma), {**options, **more})
        point = ipopt.solve(point, given["p"][1])
        iterations += point.iterations
        of = program.program
        if max(of.feasibility(point.Y), of.complementarity(point.Y)) <= GOOD:
            best = point.Y
    return best, iterations


def heart(given: dict[str, Any]) -> tuple[np.ndarray, int]:
    """kemba.solve_mpcc."""
    found = solve_mpcc(**given)
    return found.x, found.iterations


def uno(given: dict[str, Any]) -> tuple[np.ndarray, int]:
    """Uno's filter SQP on the program with products at most zero."""
    program = written(given)
    rows = program.relaxed(0.0)
    options = {"uno": {"preset": "filtersqp", "logger": "SILENT"}, "print_time": False,
               "error_on_fail": False}  # fmt: skip
    solver = ca.nlpsol("solver", "uno", program.problem.nlp, options)
    found = solver(x0=program.program.start, p=given["p"][1], lbx=rows.lower, ubx=rows.upper,
                   lbg=rows.g_lower, ubg=rows.g_upper)  # fmt: skip
    return np.array(found["x"]).ravel(), int(solver.stats().get("iter_count") or 0)


METHODS: dict[str, Callable[[dict[str, Any]], tuple[np.ndarray, int]]] = {
    "plain homotopy": plain,
    "solve_mpcc": heart,
    "Uno": uno,
}
