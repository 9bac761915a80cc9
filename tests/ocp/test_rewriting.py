"""Functions rewritten for speed give the numbers of the plain ones; so does a proximal term."""

from unittest.mock import patch

import casadi as ca
import numpy as np
import pytest

from kemba.model import load_model
from kemba.ocp import load_task
from kemba.ocp.functions import code
from kemba.ocp.functions.blocks import BlockProblem, RowBlock, block_problem
from kemba.ocp.functions.code import FEW, Code, canonical_signs, code_of, vectorised
from kemba.ocp.functions.problem import REGULARISATION, Proximal, regularised_hessian
from kemba.ocp.task.resolve import resolve
from kemba.ocp.transcription.symmetry import find_symmetry
from kemba.ocp.transcription.transcribe import Transcription

POINTS = 12


@pytest.fixture(scope="module")
def half() -> Transcription:
    """Half the jump's robot, whose stage holds both of its legs."""
    task, document = load_task("jump", ["nodes=24"])
    model = load_model(task.model)
    reduction = find_symmetry(model)
    assert reduction is not None
    return Transcription(model, task, resolve(task, model, document), reduction, 24)


@pytest.mark.parametrize("points", [1, FEW, POINTS])
def test_abreast_is_the_same_to_the_last_bit(half: Transcription, points: int) -> None:
    block, rng = half.problem.blocks[0].code, np.random.default_rng(0)
    at = [block.z, block.given]
    lam_f, lam_g = block.multipliers
    f = ca.Function("f", [*at, lam_f, lam_g], [block.g, ca.SX(block.hessian.nz[:])])
    z = rng.uniform(0.2, 0.9, (block.z.numel(), points))
    lam = rng.normal(size=(lam_g.numel(), points))
    given = np.concatenate([[1e-3, 0.1, 0.1, 0.1, 1e-5], block.numbers])
    together = vectorised(f, points, [1, 2])(z, given, 1.3, lam)
    for k in range(points):
        for every, one in zip(together, f(z[:, k], given, 1.3, lam[:, k]), strict=True):
            assert np.array_equal(np.array(every)[:, k], np.array(one).ravel())


def test_abreast_repeats_what_is_the_same_at_all_points() -> None:
    x, c = ca.SX.sym("x"), ca.SX.sym("c")
    f = ca.Function("f", [x, c], [ca.vertcat(x * c, c + 1, 2.5), ca.SX(0, 1)])
    values, nothing = vectorised(f, POINTS, [1])(np.arange(POINTS)[None, :], 3.0)
    assert np.array(values).tolist() == [[3.0 * i for i in range(POINTS)], [4.0] * 12, [2.5] * 12]
    assert nothing.shape == (0, POINTS)


def test_folding_writes_a_mirrored_leg_once() -> None:
    q, a, b = ca.SX.sym("q"), ca.SX.sym("a"), ca.SX.sym("b")

    def leg(q: ca.SX, b: ca.SX) -> ca.SX:
        return (a - b * ca.sin(q)) * ca.cos(q) + ca.atan(q) * b / a

    plain = leg(q, b) + leg(-q, -b)
    (once,) = canonical_signs([q, a, b], [plain])
    count = ca.Function("f", [q, a, b], [leg(q, b)]).n_instructions()
    f, g = ca.Function("f", [q, a, b], [plain]), ca.Function("g", [q, a, b], [once])
    assert g.n_instructions() == count + 1 < f.n_instructions()
    for at in np.random.default_rng(0).normal(size=(20, 3)):
        assert float(f(*at)) == float(g(*at))


def test_folding_shares_the_legs_of_half_a_robot(half: Transcription) -> None:
    stage = half.stage
    at = [ca.vertcat(stage.y0, stage.y), ca.vertcat(stage.eps, stage.weights)]
    plain = ca.Function("f", at, [ca.cse(ca.densify(stage.g))])
    once = ca.Function("g", at, [ca.cse(canonical_signs(at, [stage.g])[0])])
    assert once.n_instructions() < 0.8 * plain.n_instructions()
    rng = np.random.default_rng(0)
    for _ in range(3):
        z, p = rng.uniform(0.2, 0.9, at[0].numel()), [1e-3, 0.1, 0.1, 0.1, 1e-5]
        assert np.array_equal(np.array(plain(z, p)), np.array(once(z, p)))


def test_a_proximal_term_adds_half_the_squared_way() -> None:
    z = ca.SX.sym("z", 2)
    columns = np.array([[0, 1], [1, 2]])
    block = RowBlock(z, ca.vertcat(z[0] * z[1]), z[0] ** 3 - z[1], columns)
    problem = block_problem([block], 3, ca.SX(0, 1))
    near, rng = Proximal(problem), np.random.default_rng(0)
    x, start, weight = rng.normal(size=3), rng.normal(size=3), 0.7
    p, lam = [weight, *start], [0.3, -2.0]
    (f, slope), (f0, slope0) = near.grad_f(x, p), problem.grad_f(x, [])
    assert float(f) == pytest.approx(float(f0) + 0.35 * np.sum((x - start) ** 2))
    assert np.array(slope - slope0).ravel() == pytest.approx(0.7 * (x - start))
    hessians = near.hess_lag(x, p, 1.5, lam), problem.hess_lag(x, [], 1.5, lam)
    assert np.array(hessians[0] - hessians[1]) == pytest.approx(1.05 * np.eye(3))
    jacobians = near.jac_g(x, p)[1], problem.jac_g(x, [])[1]
    assert np.array_equal(*map(np.array, jacobians))
    nlp = ca.Function("nlp", [near.nlp["x"], near.nlp["p"]], [near.nlp["f"]])
    assert float(nlp(x, p)) == pytest.approx(float(f))


def test_damping_adds_the_same_curvature_everywhere() -> None:
    z = ca.SX.sym("z", 2)
    block = RowBlock(z, ca.vertcat(z[0] * z[1]), z[0] ** 3 - z[1], np.array([[0, 1], [1, 2]]))
    plain = block_problem([block], 3, ca.SX(0, 1)).hess_lag
    at = (np.random.default_rng(0).normal(size=3), [], 1.5, [0.3, -2.0])
    added = np.array(regularised_hessian(plain)(*at) - plain(*at))
    assert added == pytest.approx(REGULARISATION * np.eye(3), abs=1e-15)


def test_equal_blocks_share_their_functions_and_others_do_not() -> None:
    def code(factor: float) -> Code:
        z, p = ca.SX.sym("z", 2), ca.SX.sym("p")
        return code_of(z, p, p * z[0] ** 2, ca.sin(factor * z[1]), shared=True)

    first, same, other = code(3.7), code(3.7), code(3.8)
    assert same is first
    assert other is not first
    assert first.at(9)[0] is same.at(9)[0]
    values = [float(c.rows_at(1)([0.0, 0.5], [1.0, *c.numbers])) for c in (first, other)]
    assert values == [np.sin(3.7 * 0.5), np.sin(3.8 * 0.5)]


def test_only_so_many_blocks_are_kept() -> None:
    z, p = ca.SX.sym("z"), ca.SX.sym("p", 0)
    with patch.object(code, "KEPT", 2):
        first = code_of(z, p, z, z + 1.5, shared=True)
        for k in range(3):
            code_of(z, p, z, z + 2.5 + k, shared=True)
        assert code_of(z, p, z, z + 1.5, shared=True) is not first


def test_problems_that_differ_by_bounds_only_are_made_once() -> None:
    def problem(factor: float, last: int = 2) -> BlockProblem:
        z = ca.SX.sym("z", 2)
        block = RowBlock(z, ca.sin(factor * z[1]), z[0] ** 2, np.array([[0, 1], [1, last]]))
        return block_problem([block], 4, ca.SX(0, 1), shared=True)

    problem(2.7).hess_lag(0, 0, 1, 1)  # its functions are made, and compiled once they are large
    kept = problem(2.7)
    assert problem(2.7) is kept
    others = problem(2.7, last=3), problem(2.8)
    assert kept not in others
    x = [0.5, 0.2, 0.3, 0.4]
    values = [np.array(p.g(x, [])).ravel().tolist() for p in (kept, *others)]
    assert values == [np.sin(f * np.array(y)).tolist() for f, y in
                      ((2.7, (0.2, 0.3)), (2.7, (0.2, 0.4)), (2.8, (0.2, 0.3)))]  # fmt: skip
