"""The one wrapper of IPOPT: start, bounds, options, limits, callback, its text in a log file."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from kemba.ocp.functions.problem import (
    Derivatives,
    Program,
    Proximal,
    regularised_hessian,
    violation,
)
from kemba.ocp.nlp.ending import Ending, Stagnation
from kemba.stopwatch import Stopwatch

Watch = Callable[[int, float, float], None]  # iteration, objective, worst scaled violation


class Watcher(ca.Callback):
    """Calls `watch` after every iteration; `stop` and `stagnation` decide whether to continue.

    `parameters`: how many parameters the solved problem has.
    """

    def __init__(
        self,
        program: Program,
        watch: Watch | None,
        stop: Callable[[], bool] | None,
        stagnation: Stagnation | None,
        parameters: int,
    ) -> None:
        super().__init__()
        self.program, self.watch, self.stop = program, watch, stop
        self.stagnation, self.parameters = stagnation, parameters
        self.count = 0
        self.construct("watcher", {})

    def get_n_in(self) -> int:
        return int(ca.nlpsol_n_out())

    def get_n_out(self) -> int:
        return 1

    def get_name_in(self, i: int) -> str:
        return str(ca.nlpsol_out(i))

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        problem = self.program.problem
        rows = {"x": problem.size, "lam_x": problem.size, "f": 1}
        rows |= {"g": problem.rows, "lam_g": problem.rows}
        return ca.Sparsity.dense(rows.get(ca.nlpsol_out(i), self.parameters))

    def eval(self, arguments: Sequence[ca.DM]) -> list[int]:
        """Called by IPOPT after each iteration with its vectors x, f, g and multipliers; [1]
        stops it."""
        if self.watch is not None or self.stagnation is not None:
            worst = violation(self.program, np.asarray(arguments[2]).ravel())
            if self.watch is not None:
                self.watch(self.count, float(arguments[1]), worst)
            if self.stagnation is not None:
                self.stagnation.hear(self.count, worst)
        self.count += 1
        stagnates = self.stagnation is not None and self.stagnation.found
        return [int(stagnates or (self.stop is not None and self.stop()))]


Bounds = tuple[np.ndarray, np.ndarray]  # lower and upper, in the shape of the program's

WARM_PUSH = 1e-6  # distance from the bounds of a warm start, and least multiplier


@dataclass(frozen=True)
class Iterate:
    """A primal-dual iterate and how its solve ended.

    `Y`: variables in the shape of the program's bounds; `lam_x`, `lam_g`: multipliers of bounds
    and rows; `ending`: None for a start that was not solved yet.
    """

    Y: np.ndarray
    lam_x: np.ndarray | None = None
    lam_g: np.ndarray | None = None
    objective: float = np.nan
    ending: Ending | None = None
    iterations: int = 0

    @property
    def solved(self) -> bool:
        """Whether the solver converged."""
        return self.ending is not None and self.ending.good


@dataclass(frozen=True)
class Control:
    """What ends a solve early, and what is called after every iteration.

    `deadline` in time.monotonic(); `stop` and `watch` are called after every iteration; `log`
    collects IPOPT's text.
    """

    deadline: float = np.inf
    log: Path | None = None
    watch: Watch | None = None
    stop: Callable[[], bool] | None = None

    def ended(self) -> Ending | None:
        """How a solve ends that would begin now; None where it may begin."""
        if self.stop is not None and self.stop():
            return Ending.INTERRUPTED
        return Ending.TIME_LIMIT if self.deadline <= time.monotonic() else None

    def options(self) -> dict[str, Any]:
        """The limits as options of IPOPT."""
        options: dict[str, Any] = {}
        remaining = self.deadline - time.monotonic()
        if np.isfinite(remaining):
            options["max_wall_time"] = max(remaining, 1e-3)
        if self.log is not None:
            options |= {"output_file": str(self.log), "file_print_level": 5, "file_append": "yes"}
        return options


def common() -> dict[str, Any]:
    """IPOPT options of every solve."""
    return {
        "print_level": 0,
        "sb": "yes",
        "nlp_scaling_method": "none",
        "mu_strategy": "monotone",
        "mumps_mem_percent": 100,  # of room beyond the need; by default eleven times as much
    }


def warm(mu: float, push: float = WARM_PUSH, **more: Any) -> dict[str, Any]:
    """IPOPT options of a warm start at barrier parameter `mu`, `push` off the bounds."""
    names = ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac", "mult_bound_push")
    pushed = {f"warm_start_{name}": push for name in names}
    return {"warm_start_init_point": "yes", **pushed, "mu_init": mu, **more}


def central(mu: float, push: float) -> dict[str, Any]:
    """IPOPT options of a start near a solution with barrier parameter `mu` whose multipliers are
    not known: of bounds they are mu over the distance, of rows those of least squares."""
    return {
        "mu_init": mu,
        "bound_mult_init_method": "mu-based",
        "slack_bound_push": push,
        "slack_bound_frac": push,
    }


def last_barrier(tol: float) -> float:
    """The barrier parameter at which IPOPT ends with its tolerance `tol` (its documentation, option
    barrier_tol_factor). A solve that begins there need not lower it."""
    return tol / (10.0 + 1.0)


class Ipopt:
    """Solves a program, again and again with other parameters, bounds and options.

    `options` go to IPOPT every time; `building` counts the making of what IPOPT evaluates.
    """

    def __init__(
        self,
        program: Program,
        options: Mapping[str, Any] | None = None,
        control: Control | None = None,
        building: Stopwatch | None = None,
    ) -> None:
        self.program, self.options = program, dict(options or {})
        self.control, self.building = control or Control(), building or Stopwatch()
        self._regularised: dict[Derivatives, ca.Function] = {}

    def solve(
        self,
        start: Iterate,
        p: Sequence[float] = (),
        options: Mapping[str, Any] | None = None,
        bounds: Bounds | None = None,
        proximal: float = 0.0,
        stagnation: Stagnation | None = None,
        regularised: bool = False,
    ) -> Iterate:
        """One solve from `start` with the program's parameters `p`.

        `bounds` replace the program's own on the variables; `proximal` is the weight of half the
        squared distance from the start, in the cost; where `stagnation` is found the ending is
        GAVE_UP; `regularised` Newton steps have a multiple of the identity in the Hessian.
        """
        ended = self.control.ended()
        if ended is not None:
            return replace(start, ending=ended, iterations=0)
        program = self.program
        lower, upper = bounds or (program.lower, program.upper)
        own = {**common(), **self.options, **(options or {}), **self.control.options()}
        with self.building.running():
            problem: Derivatives = program.problem
            if proximal:
                problem = self._proximal
            parameters = [*p, proximal, *start.Y.ravel()] if proximal else list(p)
            hessian = self._regularised_hessian(problem) if regularised else problem.hess_lag
            plugin = _plugin(problem, hessian, own)
            if watcher := self._watcher(stagnation, len(parameters)):
                plugin["iteration_callback"] = watcher
            solver = ca.nlpsol("solver", "ipopt", problem.nlp, plugin)
        arguments: dict[str, Any] = {
            "x0": np.clip(start.Y, lower, upper).ravel(),
            "p": parameters,
            "lbx": lower.ravel(),
            "ubx": upper.ravel(),
            "lbg": program.g_lower,
            "ubg": program.g_upper,
        }
        if start.lam_g is not None and own.get("warm_start_init_point") == "yes":
            arguments |= {"lam_x0": start.lam_x, "lam_g0": start.lam_g}
        found, stats = solver(**arguments), solver.stats()
        gave_up = stagnation is not None and stagnation.found
        return Iterate(
            Y=np.array(found["x"]).reshape(lower.shape),
            lam_x=np.array(found["lam_x"]).ravel(),
            lam_g=np.array(found["lam_g"]).ravel(),
            objective=float(found["f"]),
            ending=Ending.GAVE_UP if gave_up else Ending.of_ipopt(str(stats["return_status"])),
            iterations=int(stats["iter_count"]),
        )

    @cached_property
    def _proximal(self) -> Proximal:
        return Proximal(self.program.problem)

    def _regularised_hessian(self, problem: Derivatives) -> ca.Function:
        if problem not in self._regularised:
            self._regularised[problem] = regularised_hessian(problem.hess_lag)
        return self._regularised[problem]

    def _watcher(self, stagnation: Stagnation | None, parameters: int) -> Watcher | None:
        """The callback; None where nothing needs it."""
        watch, stop = self.control.watch, self.control.stop
        if watch is None and stop is None and stagnation is None:
            return None
        return Watcher(self.program, watch, stop, stagnation, parameters)


def _plugin(
    problem: Derivatives, hessian: ca.Function, options: Mapping[str, Any]
) -> dict[str, Any]:
    return {
        "print_time": False,
        "error_on_fail": False,
        "grad_f": problem.grad_f,
        "jac_g": problem.jac_g,
        "hess_lag": hessian,
        "calc_lam_p": False,
        "no_nlp_grad": True,
        **{f"ipopt.{name}": value for name, value in options.items()},
    }
