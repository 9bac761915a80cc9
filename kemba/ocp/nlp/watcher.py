"""IPOPT's callback after every iteration."""

from collections.abc import Callable, Sequence

import casadi as ca
import numpy as np

from kemba.ocp.functions.problem import Program, violation
from kemba.ocp.nlp.ending import Stagnation

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
