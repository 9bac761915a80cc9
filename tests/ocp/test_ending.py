"""How solves end: what IPOPT says is read in one place, and reports have its words."""

import json
import re
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

import kemba.ocp
from kemba.ocp.certificate.status import Status
from kemba.ocp.functions.blocks import RowBlock, block_problem
from kemba.ocp.nlp.ending import Ending
from kemba.ocp.nlp.ipopt import Control, Ipopt, Iterate


class Parabola:
    """min sum (x - 3)^2 with `least` <= sum x; satisfies the `Program` contract."""

    def __init__(self, least: float = 0.0, most: float = 1.0) -> None:
        x = ca.SX.sym("x", 2)
        block = RowBlock(x, ca.sum1(x), ca.sumsqr(x - 3.0), np.array([[0, 1]]))
        self.problem = block_problem([block], 2, ca.SX(0, 1))
        self.lower, self.upper = np.full((1, 2), -1.0), np.full((1, 2), 1.0)
        self.g_lower, self.g_upper = np.array([least]), np.array([most])


def solved(program: Parabola, control: Control | None = None, **options: object) -> Iterate:
    return Ipopt(program, options, control).solve(Iterate(np.zeros((1, 2))))


def test_a_program_of_any_shape_is_solved() -> None:
    found = solved(Parabola(), tol=1e-10)
    assert found.ending is Ending.SOLVED and found.solved
    assert pytest.approx(np.full((1, 2), 0.5), abs=1e-7) == found.Y


def test_what_cannot_be_met_is_infeasible() -> None:
    found = solved(Parabola(least=3.0, most=4.0))
    assert found.ending is Ending.INFEASIBLE and not found.solved


def test_limits_and_users_end_a_solve() -> None:
    assert solved(Parabola(), max_iter=1).ending is Ending.ITERATION_LIMIT
    late = solved(Parabola(), Control(deadline=0.0))
    assert (late.ending, late.iterations) == (Ending.TIME_LIMIT, 0)
    asked: list[int] = []
    control = Control(stop=lambda: len(asked) > 1, watch=lambda *values: asked.append(1))
    assert solved(Parabola(), control).ending is Ending.INTERRUPTED


def test_an_unknown_word_of_ipopt_is_a_failure() -> None:
    assert Ending.of_ipopt("Invalid_Option") is Ending.FAILED
    assert not Ending.FAILED.good


def test_each_ending_has_its_own_sentence_and_says_whether_to_go_on() -> None:
    assert len({ending.sentence for ending in Ending}) == len(Ending)
    assert {e for e in Ending if e.good} == {Ending.SOLVED, Ending.ACCEPTABLE}
    assert {e for e in Ending if e.cut_short} == {Ending.INTERRUPTED, Ending.TIME_LIMIT}


def test_reports_have_the_words_of_the_contract() -> None:
    words = ["solved", "acceptable", "infeasible", "stalled", "limit", "interrupted"]
    assert json.loads(json.dumps(list(Status))) == [str(s) for s in Status] == words
    assert f"{Ending.GAVE_UP}" == "gave-up"


def test_ipopts_words_stand_in_one_file_only() -> None:
    word = re.compile(r"_Succeeded|_Detected|_Exceeded|User_Requested|Solved_To|_Failed\b")
    folder = Path(kemba.ocp.__file__).parent.parent
    found = {p.name for p in folder.rglob("*.py") if word.search(p.read_text(encoding="utf-8"))}
    assert found == {"ending.py"}
