"""Proximal points: the last one that is solved is kept, with less pull from one to the next."""

from typing import Any

import numpy as np
import pytest

from kemba.ocp.nlp.ending import Ending
from kemba.ocp.nlp.ipopt import Iterate
from kemba.ocp.refinement.proximal import PULLS, proximal_points


class Valley:
    """A program whose cost is (x - 3)^2, with a pull to the last point."""

    pull = 0.0
    at = np.zeros(1)

    def proximal(self, x: np.ndarray, weight: float) -> np.ndarray:
        self.pull, self.at = weight, x
        return x


def last(fails: int) -> tuple[Any, int]:
    """The last point where solve number `fails` is not solved, and how many were made."""
    made: list[float] = []

    def solve(program: Any, x: np.ndarray) -> Iterate:
        new = (2 * 3.0 + program.pull * x) / (2 + program.pull)
        made.append(program.pull)
        return Iterate(new, ending=Ending.GAVE_UP if len(made) == fails else Ending.SOLVED)

    first: Any = Valley()
    found = proximal_points(lambda near, x: (Valley(), x), solve, first, np.zeros(1))
    return found, len(made)


def test_all_points_are_solved_and_the_last_has_no_pull() -> None:
    found, solves = last(fails=0)
    assert solves == len(PULLS)
    assert found[0].pull == 0.0 and found[1].Y[0] == pytest.approx(3.0)


def test_where_one_is_not_solved_the_one_before_is_kept() -> None:
    assert last(fails=1) == (None, 1)
    found, solves = last(fails=3)
    assert solves == 3 and found[0].pull == PULLS[1] and found[1].ending is Ending.SOLVED
