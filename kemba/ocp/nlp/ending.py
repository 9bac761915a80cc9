"""How a solve ended: the word, its sentence, what IPOPT calls it; and when it is given up."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from time import thread_time

import numpy as np


class Ending(str, Enum):
    """How one solve ended; the value is a word for reports, `sentence` says it in plain words."""

    sentence: str

    SOLVED = "solved", "the solver found a best point"
    ACCEPTABLE = "acceptable", "the solver nearly found a best point"
    INFEASIBLE = "infeasible", "the solver found no point near its last one that violates less"
    STALLED = "stalled", "the solver's steps became too small to make progress"
    GAVE_UP = "gave-up", "the violation stopped falling, so the solve was given up"
    DIVERGED = "diverged", "the solver's variables grew without bound"
    NUMERICAL = "numerical", "the solver met a number that is not finite or a singular system"
    ITERATION_LIMIT = "iteration-limit", "the limit of iterations was reached"
    TIME_LIMIT = "time-limit", "the time limit was reached"
    INTERRUPTED = "interrupted", "the user stopped it"
    REFUSED = "refused", "nothing was solved, since a check showed that no plan exists"
    UNSUITABLE = "unsuitable", "the method does not apply to this model"
    FAILED = "failed", "the solver refused the program or its options"

    def __new__(cls, word: str, sentence: str) -> Ending:
        member = str.__new__(cls, word)
        member._value_, member.sentence = word, sentence
        return member

    def __str__(self) -> str:
        return str(self.value)

    @property
    def good(self) -> bool:
        """Whether the solver converged."""
        return self in (Ending.SOLVED, Ending.ACCEPTABLE)

    @property
    def limit(self) -> bool:
        """Whether a limit of iterations or time ended it."""
        return self in (Ending.ITERATION_LIMIT, Ending.TIME_LIMIT)

    @property
    def cut_short(self) -> bool:
        """Whether nothing else may be tried after it: the user or the time limit ended it."""
        return self in (Ending.INTERRUPTED, Ending.TIME_LIMIT)

    @classmethod
    def of_ipopt(cls, return_status: str) -> Ending:
        """The ending that IPOPT's return status means; FAILED for one that is not listed."""
        return _IPOPT.get(return_status, cls.FAILED)


_IPOPT = {
    "Solve_Succeeded": Ending.SOLVED,
    "Feasible_Point_Found": Ending.SOLVED,  # IPOPT's success on a square problem
    "Solved_To_Acceptable_Level": Ending.ACCEPTABLE,
    "Infeasible_Problem_Detected": Ending.INFEASIBLE,
    "Search_Direction_Becomes_Too_Small": Ending.STALLED,
    "Restoration_Failed": Ending.STALLED,
    "Diverging_Iterates": Ending.DIVERGED,
    "Error_In_Step_Computation": Ending.NUMERICAL,
    "Invalid_Number_Detected": Ending.NUMERICAL,
    "Maximum_Iterations_Exceeded": Ending.ITERATION_LIMIT,
    "Maximum_CpuTime_Exceeded": Ending.TIME_LIMIT,
    "Maximum_WallTime_Exceeded": Ending.TIME_LIMIT,
    "User_Requested_Stop": Ending.INTERRUPTED,
}


USUAL = 5  # iterations by whose median time others are called long
PROGRESS = 0.8  # part of the violation that may be left where a solve makes progress


@dataclass
class Stagnation:
    """A test that is `found` once the worst scaled violation has not fallen by a fifth within
    `iterations`, unless it was below `small` before; or once long iterations have cost as much time
    as `slow` usual ones: the linear systems are nearly singular, and more of them follow."""

    iterations: float
    small: float
    slow: float = np.inf
    best: float = np.inf
    since: int = 0
    found: bool = False
    ends: list[float] = field(default_factory=list)  # of iterations, processor time [s]

    def hear(self, iteration: int, violation: float) -> None:
        """Take notice of an iteration."""
        self.ends.append(thread_time())
        if violation < PROGRESS * self.best:
            self.best, self.since = violation, iteration
        stuck = self.best > self.small and iteration - self.since >= self.iterations
        self.found = stuck or self.too_slow()

    def too_slow(self) -> bool:
        """Whether long iterations have cost too much."""
        lasted = np.diff(self.ends)
        if len(lasted) <= USUAL:
            return False
        usual = float(np.median(lasted[:USUAL]))
        return bool(lasted.sum() - len(lasted) * usual > self.slow * usual)
