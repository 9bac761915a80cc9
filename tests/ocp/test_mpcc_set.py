"""Programs with complementarity pairs from the literature, whose optima are known."""

import numpy as np
import pytest
from mpcc.methods import on_branch, schedule
from mpcc.problem import Mpcc, problems
from mpcc_set import best_of_branches, judged


@pytest.mark.parametrize(
    "name", ["jr1", "scholtes1", "scholtes5", "bard1", "stackelberg1", "outrata32", "ex9.2.6"]
)
def test_the_schedule_finds_known_optima(name: str) -> None:
    program = Mpcc(name, problems()[name])
    assert judged(program, schedule(program, program.start)) == (True, True)


@pytest.mark.parametrize("name", ["kth1", "scholtes4", "qpec2"])
def test_a_corner_that_the_relaxation_rounds_is_exact_on_its_branch(name: str) -> None:
    program = Mpcc(name, problems()[name])
    assert judged(program, schedule(program, program.start)) == (True, False)
    assert judged(program, on_branch(program, program.start)) == (True, True)


@pytest.mark.parametrize("name", ["ralph1", "jr2", "df1", "ex9.2.5", "ex9.1.9"])
def test_the_best_values_are_those_of_the_best_branch(name: str) -> None:
    assert best_of_branches(name) == pytest.approx(problems()[name]["best"], abs=1e-5)


def test_a_point_off_the_pairs_is_not_feasible() -> None:
    program = Mpcc("kth3", problems()["kth3"])
    assert program.violation(np.array([0.5, 0.5])) == pytest.approx(0.25)
    assert program.violation(np.array([1.0, -0.1])) == pytest.approx(0.1)
    assert program.violation(np.array([0.0, 1.0])) == 0.0
    assert program.cost(np.array([0.0, 1.0])) == pytest.approx(0.5)
