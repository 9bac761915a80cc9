"""kemba.solve_mpcc on small programs whose solutions are known."""

import time
from typing import Any

import casadi as ca
import numpy as np
import pytest
from mpcc.methods import heart
from mpcc.problem import Mpcc as Known
from mpcc.problem import problems
from mpcc_set import judged

import kemba
from kemba.errors import KembaError
from kemba.ocp.mpcc.problem import Mpcc
from kemba.ocp.mpcc.solve import (
    OnBranch,
    Solves,
    _along,
    both_zero,
    descending,
    multipliers,
    pulled,
)
from kemba.ocp.nlp.ipopt import Control, Iterate

x = ca.SX.sym("x", 2)
CORNER = (x[0] - 1) ** 2 + (x[1] - 1) ** 2


def solve(f: ca.SX, g: ca.SX | None = None, **more: Any) -> Any:
    """min f over x with the pair (x0, x1), from zero."""
    given = {"bounds": {}, "start": 0.0, "G": x[0], "H": x[1], **more}
    return kemba.solve_mpcc(x, f, ca.SX(0, 1) if g is None else g, **given)


@pytest.mark.parametrize("start", [[0.0, 0.0], [5.0, 0.0], [3.0, 3.0]])
def test_a_corner_that_is_c_stationary_is_left(start: list[float]) -> None:
    """At zero both multipliers are negative: C-stationary, but either side descends."""
    found = solve(CORNER, start=start)
    assert found.good and found.stationarity == "strong"
    assert found.f == pytest.approx(1.0, abs=1e-6)
    assert found.complementarity <= 1e-12


def test_the_residual_is_what_is_left_of_the_gradient() -> None:
    """Over one and the largest multiplier: of a slope of 3 where nothing holds, all of it; where a
    bound holds it, nothing."""
    y = ca.SX.sym("y", 3)
    bounds = {"lbx": [-1.0, -1.0, 0.0]}
    program = Mpcc(y, 3.0 * y[2], ca.SX(0, 1), y[0], y[1], bounds, 0.0, None)
    none, first = np.zeros(program.problem.rows), np.zeros(1, bool)
    free, held = (multipliers(program, np.array([1.0, 1.0, z]), none, first) for z in (1.0, 0.0))
    assert free.residual == pytest.approx(3.0)
    assert held.residual == pytest.approx(0.0) and held.lam_x[2] == pytest.approx(-3.0)


def test_a_corner_that_is_the_optimum_is_kept() -> None:
    found = solve((x[0] + 1) ** 2 + (x[1] + 1) ** 2, start=[3.0, 1.0])
    assert found.good and found.stationarity == "strong"
    assert found.x == pytest.approx([0.0, 0.0], abs=1e-6)
    assert np.all(found.multipliers.nu_first > 1.9) and np.all(found.multipliers.nu_second > 1.9)


def test_the_better_side_is_found() -> None:
    found = solve((x[0] - 1) ** 2 + (x[1] - 2) ** 2)
    assert found.x == pytest.approx([0.0, 2.0], abs=1e-6)


def test_multipliers_without_bound_leave_b_stationarity_to_the_linear_program() -> None:
    """scholtes4: at the optimum no multipliers prove it, and those of relaxations grow."""
    z = ca.SX.sym("z", 3)
    rows = ca.vertcat(z[2] - 4 * z[0], z[2] - 4 * z[1])
    found = kemba.solve_mpcc(z, z[0] + z[1] - z[2], rows, z[0], z[1], {"ubg": 0}, 1.0)
    assert found.good and found.stationarity == "B"
    assert found.f == pytest.approx(0.0, abs=1e-6)


def test_a_point_without_products_does_not_exist() -> None:
    """x0 >= 0.5 and x1 >= 0.5 leave no product at zero."""
    found = solve(CORNER, bounds={"lbx": 0.5})
    assert not found.good and found.status == "infeasible"
    assert "no feasible point" in found.sentence


def test_rows_that_contradict_each_other() -> None:
    found = solve(
        CORNER, ca.vertcat(x[0] + x[1], x[0] + x[1]), bounds={"lbg": [1, -1], "ubg": [2, 0]}
    )
    assert found.status == "infeasible" and found.feasibility > 0.1


def test_sides_that_are_expressions_and_occur_twice() -> None:
    """0 <= 1 - x0 against x1 and against 2 - x1: one of x0 = 1, or x1 = 0 and x1 = 2."""
    G, H = ca.vertcat(1 - x[0], 1 - x[0]), ca.vertcat(x[1], 2 - x[1])
    found = solve(x[0] ** 2 + (x[1] - 1) ** 2, G=G, H=H)
    assert found.good and found.x == pytest.approx([1.0, 1.0], abs=1e-6)


def test_parameters_and_mx_give_the_same_point() -> None:
    y, p = ca.MX.sym("y", 2), ca.MX.sym("p")
    cost = (y[0] - p) ** 2 + (y[1] - 1) ** 2
    found = kemba.solve_mpcc(y, cost, ca.MX(0, 1), y[0], y[1], {}, 0.0, p=(p, 3.0))
    assert found.good and found.x == pytest.approx([3.0, 0.0], abs=1e-6)


def test_an_ordinary_program_has_no_pairs() -> None:
    found = solve(CORNER, G=ca.SX(0, 1), H=ca.SX(0, 1), bounds={"ubx": [0.5, 3.0]})
    assert found.good and found.x == pytest.approx([0.5, 1.0], abs=1e-6)


def test_what_is_reported_is_measured_at_the_point() -> None:
    program = Mpcc(x, CORNER, ca.SX(0, 1), x[0], x[1], {"ubx": 1.0}, 0.0, None)
    at = np.array([0.5, 2.0])
    assert program.complementarity(at) == pytest.approx(1.0)
    assert program.feasibility(at) == pytest.approx(1.0)


def test_the_linear_program_finds_the_branch_that_descends() -> None:
    program = Mpcc(x, CORNER, ca.SX(0, 1), x[0], x[1], {}, 0.0, None)
    at, first = np.zeros(2), np.array([True])
    zero = both_zero(program, at, 1e-6)
    assert zero.all() and pulled(multipliers(program, at, np.zeros(1), first), zero).all()
    answer = descending(program, at, first, zero)
    assert answer is not None and answer[0] == pytest.approx(2e-3)


@pytest.mark.parametrize(
    ("more", "what"),
    [
        ({"G": ca.vertcat(x[0], x[1])}, "G has 2 entries and H 1"),
        ({"bounds": {"lbx": np.nan}}, "lbx: entry 0 is nan"),
        ({"bounds": {"lbx": [0, 2], "ubx": [1, 1]}}, "entry 1: no number lies between 2 and 1"),
        ({"bounds": {"lbx": np.inf}}, "no number lies between"),
        ({"bounds": {"lower": 0}}, "unknown bound 'lower'"),
        ({"bounds": {"ubx": [1, 2, 3]}}, "ubx: has 3 entries; 2, or one for all of them"),
        ({"start": [0.0, np.nan]}, "start: entry 1 is nan"),
        ({"start": "far"}, "start: is not made of numbers"),
        ({"f": ca.log(x[0] - 9)}, "f: entry 0 is nan at the start"),
        ({"f": x}, "f: has 2 entries"),
        ({"f": ca.SX.sym("q") + x[0]}, "hold symbols that are neither in x nor in p"),
        ({"f": ca.MX.sym("q")}, "f: is not an expression of the same kind as x"),
        ({"p": (ca.SX.sym("p", 2), [1.0, 2.0, 3.0])}, "p: has 3 entries; 2, or one"),
    ],
)  # fmt: skip
def test_bad_input_is_refused_by_name(more: dict[str, Any], what: str) -> None:
    with pytest.raises(KembaError) as error:
        solve(**{"f": CORNER, **more})
    assert what in str(error.value)


def test_the_time_limit_leaves_a_judged_point() -> None:
    found = solve(CORNER, time_limit=0.0)
    assert found.status == "time-limit" and not found.good
    assert np.isfinite(found.feasibility)


@pytest.mark.parametrize(("known", "kept"), [(0.5, True), (1.5, False)])
def test_a_path_that_is_not_cheaper_ends_early(known: float, kept: bool) -> None:
    """The optimum is 1: where a point with cost 0.5 is known, no branch is solved."""
    names: list[str] = []
    program = Mpcc(x, CORNER, ca.SX(0, 1), x[0], x[1], {}, 0.0, None)
    of = multipliers(program, np.zeros(2), np.zeros(1), np.array([True]))
    best = Iterate(np.zeros(2), objective=known), OnBranch(np.array([True]), of, "strong")
    found = _along(Solves(program, Control(), {}, names.append), "monotone", best, 1e-6)
    assert (found is best) == kept and ("branch" not in names) == kept
    assert found[0].objective == pytest.approx(min(known, 1.0), abs=1e-6)


def test_a_time_limit_in_the_second_path_leaves_the_point_of_the_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    names: list[str] = []

    def progress(name: str) -> None:
        names.append(name)
        if names.count("relaxed by 1e+00") == 2:
            monkeypatch.setattr(time, "monotonic", lambda: np.inf)

    found = solve(CORNER, time_limit=1e6, progress=progress)
    assert names[-1] == "relaxed by 1e+00"
    assert found.good and found.f == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize(
    "name", ["kth1", "scholtes4", "qpec2", "scholtes3", "ralph1", "outrata32", "ex9.1.4", "scale3"]
)
def test_known_optima_of_the_literature(name: str) -> None:
    """Also those whose corners the relaxation of the plans rounds."""
    program = Known(name, problems()[name])
    assert judged(program, heart(program, program.start)) == (True, True)
