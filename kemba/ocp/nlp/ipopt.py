"""IPOPT on a transcription: options checked, its text in a log file, warm starts, a time limit."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import casadi as ca
import numpy as np

from kemba.ocp.nlp.blocks import BlockProblem
from kemba.ocp.nlp.proximal import Proximal
from kemba.ocp.nlp.regularised import regularised_hessian
from kemba.ocp.nlp.stagnation import GAVE_UP, Stagnation
from kemba.ocp.transcription.transcribe import Transcription
from kemba.stopwatch import Stopwatch

SOLVED = ("Solve_Succeeded", "Solved_To_Acceptable_Level")


@dataclass(frozen=True)
class Iterate:
    """A primal-dual iterate: Y (nodes + 1, n), multipliers of bounds and rows, and how it ended."""

    Y: np.ndarray
    lam_x: np.ndarray | None = None
    lam_g: np.ndarray | None = None
    objective: float = np.nan
    message: str = ""
    iterations: int = 0

    @property
    def solved(self) -> bool:
        """Whether IPOPT says it converged."""
        return self.message in SOLVED


@dataclass(frozen=True)
class Parameters:
    """What a step of a schedule sets: pair relaxation, the weights of valve penalty and switching
    (per node of the grid's mean), of the pair penalty (per pair), of squared scaled forces, and of
    the way from the start (half its square in scaled variables)."""

    eps: float
    valve: float = 0.0
    switching: float = 0.0
    pairs: float = 0.0
    forces: float = 0.0
    anchor: float = 0.0

    def vector(self, nodes: int) -> list[float]:
        """The program's parameters on a grid of `nodes`."""
        return [self.eps, self.valve / nodes, self.switching / nodes, self.pairs, self.forces]


Watch = Callable[[int, float, float], None]  # iteration, objective, worst scaled violation


class Watched(Protocol):
    """A program whose rows and their bounds a watcher may ask for."""

    @property
    def problem(self) -> BlockProblem: ...
    @property
    def g_lower(self) -> np.ndarray: ...
    @property
    def g_upper(self) -> np.ndarray: ...


class Watcher(ca.Callback):
    """Tells `watch` about every iteration, and asks `stop` and `patience` whether to go on."""

    def __init__(
        self,
        program: Watched,
        watch: Watch | None,
        stop: Callable[[], bool] | None,
        patience: Stagnation | None,
        parameters: int | None = None,
    ) -> None:
        super().__init__()
        self.t, self.watch, self.stop, self.patience = program, watch, stop, patience
        self.count = 0
        self.parameters = program.problem.p.numel() if parameters is None else parameters
        self.construct("watcher", {})

    def get_n_in(self) -> int:
        return int(ca.nlpsol_n_out())

    def get_n_out(self) -> int:
        return 1

    def get_name_in(self, i: int) -> str:
        return str(ca.nlpsol_out(i))

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        rows = {"x": self.t.problem.size, "lam_x": self.t.problem.size, "f": 1}
        rows |= {"g": self.t.problem.rows, "lam_g": self.t.problem.rows}
        return ca.Sparsity.dense(rows.get(ca.nlpsol_out(i), self.parameters))

    def eval(self, arguments: Sequence[ca.DM]) -> list[int]:
        if self.watch is not None or self.patience is not None:
            g = np.asarray(arguments[2]).ravel()
            over = np.maximum(self.t.g_lower - g, g - self.t.g_upper)
            violation = float(over.max(initial=0.0))
            if self.watch is not None:
                self.watch(self.count, float(arguments[1]), violation)
            if self.patience is not None:
                self.patience.hear(self.count, violation)
        self.count += 1
        lost = self.patience is not None and self.patience.lost
        return [int(lost or (self.stop is not None and self.stop()))]


COMMON: dict[str, Any] = {
    "print_level": 0,
    "sb": "yes",
    "nlp_scaling_method": "none",
    "mu_strategy": "monotone",
    # By default MUMPS asks for eleven times what it expects to need, and the system hands out and
    # takes back pages at every factorisation. Where twice as much is too little it asks again.
    "mumps_mem_percent": 100,
}

WARM: dict[str, Any] = {
    "warm_start_init_point": "yes",
    "warm_start_bound_push": 1e-6,
    "warm_start_bound_frac": 1e-6,
    "warm_start_slack_bound_push": 1e-6,
    "warm_start_slack_bound_frac": 1e-6,
    "warm_start_mult_bound_push": 1e-6,
}


class Ipopt:
    """Solves a transcription, again and again with other parameters, bounds and options.

    `options` go to IPOPT every time; `log` collects its text; `deadline` is in time.monotonic();
    `building` counts the making of what IPOPT evaluates.
    """

    def __init__(
        self,
        transcription: Transcription,
        options: Mapping[str, Any] | None = None,
        log: Path | None = None,
        deadline: float = np.inf,
        watch: Watch | None = None,
        stop: Callable[[], bool] | None = None,
        building: Stopwatch | None = None,
    ) -> None:
        self.transcription, self.options = transcription, dict(options or {})
        self.log, self.deadline, self.watch, self.stop = log, deadline, watch, stop
        self.building, self.iterations = building or Stopwatch(), 0
        self._damped: dict[BlockProblem | Proximal, ca.Function] = {}

    def solve(
        self,
        start: Iterate,
        parameters: Parameters,
        options: Mapping[str, Any] | None = None,
        fixed: Mapping[int, np.ndarray] | None = None,
        free: Mapping[int, tuple[np.ndarray, np.ndarray]] | None = None,
        patience: Stagnation | None = None,
    ) -> Iterate:
        """One solve from `start`; `fixed` maps columns of Y to values (nodes + 1,) they keep,
        `free` to bounds that hold as well. Where `patience` is lost its message is GAVE_UP."""
        t = self.transcription
        remaining = self.deadline - time.monotonic()
        if self.stop is not None and self.stop():
            return replace(start, message="User_Requested_Stop", iterations=0)
        if remaining <= 0:
            return replace(start, message="Maximum_CpuTime_Exceeded", iterations=0)
        lower, upper = t.lower.copy(), t.upper.copy()
        for column, values in (fixed or {}).items():
            lower[1:, column] = upper[1:, column] = values[1:]
        for column, (low, high) in (free or {}).items():
            lower[1:, column] = np.maximum(lower[1:, column], low[1:])
            upper[1:, column] = np.minimum(upper[1:, column], high[1:])
        own = {**COMMON, **self.options, **(options or {})}
        if np.isfinite(remaining):
            own["max_wall_time"] = remaining
        if self.log is not None:
            own |= {"output_file": str(self.log), "file_print_level": 5, "file_append": "yes"}
        with self.building.running():
            problem, p = self._posed(parameters, start)
            plugin = self._plugin(problem, self._newton(problem, parameters), own)
            if any(listener is not None for listener in (self.watch, self.stop, patience)):
                watcher = Watcher(t, self.watch, self.stop, patience, len(p))
                plugin["iteration_callback"] = watcher
            solver = ca.nlpsol("solver", "ipopt", problem.nlp, plugin)
        arguments: dict[str, Any] = {
            "x0": np.clip(start.Y, lower, upper).ravel(),
            "p": p,
            "lbx": lower.ravel(),
            "ubx": upper.ravel(),
            "lbg": t.g_lower,
            "ubg": t.g_upper,
        }
        if start.lam_g is not None and own.get("warm_start_init_point") == "yes":
            arguments |= {"lam_x0": start.lam_x, "lam_g0": start.lam_g}
        found = solver(**arguments)
        stats = solver.stats()
        self.iterations += int(stats["iter_count"])
        return Iterate(
            Y=np.array(found["x"]).reshape(t.shape),
            lam_x=np.array(found["lam_x"]).ravel(),
            lam_g=np.array(found["lam_g"]).ravel(),
            objective=float(found["f"]),
            message=GAVE_UP if patience and patience.lost else str(stats["return_status"]),
            iterations=int(stats["iter_count"]),
        )

    def _posed(
        self, parameters: Parameters, start: Iterate
    ) -> tuple[BlockProblem | Proximal, list[float]]:
        """The problem, anchored where asked, and its parameters."""
        problem, p = self.transcription.problem, parameters.vector(self.transcription.nodes)
        if not parameters.anchor:
            return problem, p
        return self._anchored, [*p, parameters.anchor, *start.Y.ravel()]

    @cached_property
    def _anchored(self) -> Proximal:
        return Proximal(self.transcription.problem)

    def _newton(self, problem: BlockProblem | Proximal, parameters: Parameters) -> ca.Function:
        """The Hessian that Newton steps are made with: damped on a whole robot with relaxed pairs.

        Half a robot is as quick without. The paper's penalty on pairs stays as it is, for it is
        there to be compared with.
        """
        stage, half = self.transcription.stage, self.transcription.reduction.symmetric
        if half or parameters.pairs or not any(r.kind == "pair" for r in stage.rows):
            return problem.hess_lag
        if problem not in self._damped:
            self._damped[problem] = regularised_hessian(problem.hess_lag)
        return self._damped[problem]

    @staticmethod
    def _plugin(
        problem: BlockProblem | Proximal, hessian: ca.Function, options: Mapping[str, Any]
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
