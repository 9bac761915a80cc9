"""The program's derivatives against differences, its rows' names, its grids."""

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest

from kemba.model import load_model
from kemba.ocp import load_task
from kemba.ocp.planner import grids
from kemba.ocp.relaxation.guess import automatic_guess
from kemba.ocp.relaxation.schedule import prolong, widen
from kemba.ocp.task.resolve import resolve
from kemba.ocp.transcription.symmetry import find_symmetry, whole
from kemba.ocp.transcription.transcribe import Transcription

PARAMETERS = [1e-3, 0.1, 0.05, 0.02, 1e-2]
STEP = 1e-6


def program(symmetric: bool, nodes: int = 5) -> Transcription:
    """The jump's program on a very coarse grid."""
    task, document = load_task("jump.yaml", [f"nodes={nodes}"])
    model = load_model(task.model)
    reduction = find_symmetry(model) if symmetric else whole(model.node)
    assert reduction is not None
    return Transcription(model, task, resolve(task, model, document), reduction, nodes)


def guess(program: Transcription) -> np.ndarray:
    """The automatic guess on a program's grid."""
    t = program
    return automatic_guess(t.model, t.task, t.requirements, t.layout, t.nodes)


@pytest.fixture(scope="module", params=[False, True], ids=["whole", "half"])
def any_program(request: pytest.FixtureRequest) -> Transcription:
    return program(request.param)


def along(f: Callable[[np.ndarray], np.ndarray], x: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Central difference of f at x along d."""
    return np.asarray((f(x + STEP * d) - f(x - STEP * d)) / (2 * STEP))


def test_derivatives_agree_with_differences(any_program: Transcription) -> None:
    problem, rng = any_program.problem, np.random.default_rng(0)
    x = guess(any_program).ravel() + 0.02 * rng.normal(size=problem.size)
    d = rng.normal(size=problem.size)
    lam_f, lam_g = 1.3, rng.normal(size=problem.rows)

    def jacobian(x: np.ndarray) -> ca.DM:
        return problem.jac_g(x, PARAMETERS)[1]

    def gradient(x: np.ndarray) -> np.ndarray:
        return np.array(problem.grad_f(x, PARAMETERS)[1]).ravel()

    def lagrangian(x: np.ndarray) -> np.ndarray:
        return lam_f * gradient(x) + np.array(jacobian(x).T @ lam_g).ravel()

    g = along(lambda x: np.array(problem.g(x, PARAMETERS)).ravel(), x, d)
    assert np.array(jacobian(x) @ d).ravel() == pytest.approx(g, rel=1e-6, abs=1e-6)
    f = along(lambda x: np.array(problem.grad_f(x, PARAMETERS)[0]).ravel(), x, d)
    assert gradient(x) @ d == pytest.approx(float(f[0]), rel=1e-6)
    upper = problem.hess_lag(x, PARAMETERS, lam_f, lam_g)
    assert upper.sparsity().is_triu()
    H = np.array(ca.triu2symm(upper))
    assert H @ d == pytest.approx(along(lagrangian, x, d), rel=1e-5, abs=1e-5 * abs(H).max())


def test_every_row_has_a_meaning(any_program: Transcription) -> None:
    t = any_program
    assert len(t.meanings) == t.constraints == t.problem.rows
    kinds = {m.kind for m in t.meanings}
    assert kinds == {"defect", "pair", "sign", "limit", "requirement"}
    assert {m.node for m in t.meanings} == set(range(t.nodes + 1))
    assert "front/contact:gap" in {m.label for m in t.meanings}


def test_half_the_robot_is_about_half_the_program() -> None:
    half, full = program(True), program(False)
    assert 0.4 < half.variables / full.variables < 0.55
    assert 0.4 < half.constraints / full.constraints < 0.55


def test_widened_half_plans_keep_their_rows() -> None:
    """Where the half program's rows are met, so are the whole one's: the defects agree."""
    half, full = program(True), program(False)
    Y = guess(half) + 0.01
    wide = widen(half, full, Y)
    defects = []
    for t, y in ((half, Y), (full, wide)):
        g = np.array(t.problem.g(y.ravel(), PARAMETERS)).ravel()
        rows = [i for i, m in enumerate(t.meanings) if m.kind in ("pair", "sign")]
        defects.append((g[rows].min(), g[rows].max()))
    assert defects[0] == pytest.approx(defects[1], abs=1e-12)


def test_prolongation_keeps_states_and_holds_inputs() -> None:
    coarse, fine = program(True, 4), program(True, 8)
    Y = np.clip(guess(coarse) + 0.3, coarse.lower, coarse.upper)
    longer = prolong(coarse, fine, Y)
    assert longer.shape == fine.shape
    q, u = coarse.layout.slices["q"], coarse.layout.slices["u"]
    assert longer[::2, q] == pytest.approx(Y[:, q])
    assert longer[1::2, u] == pytest.approx(Y[1:, u])
    assert longer[2::2, u] == pytest.approx(Y[1:, u])


@pytest.mark.parametrize("name", ["automatic", "standing"])
def test_a_guess_is_within_bounds(name: str) -> None:
    task, document = load_task("jump.yaml", ["nodes=20", f"guess={name}", "guess_noise=0.2"])
    model = load_model(task.model)
    t = Transcription(model, task, resolve(task, model, document), whole(model.node), 20)
    Y = guess(t)
    assert np.array_equal(Y, np.clip(Y, t.layout.lower, t.layout.upper))
    z = t.layout.full(Y, "q")[:, 1]
    assert bool(z.max() > 0.4) == (name == "automatic")


@pytest.mark.parametrize(
    ("nodes", "duration", "expected"),
    [
        (100, 0.7, [50, 100]),
        (60, 0.4, [30, 60]),
        (400, 0.7, [50, 100, 200, 400]),
        (250, 0.7, [62, 125, 250]),
        (200, 1.0, [50, 100, 200]),
        (200, 1.4, [50, 100, 200]),
        (282, 2.7, [141, 282]),  # chambers fill within a step of 38 ms
        (100, 5.0, [50, 100]),
    ],
)
def test_valves_are_sought_on_coarse_grids(
    nodes: int, duration: float, expected: list[int]
) -> None:
    assert grids(nodes, duration) == expected
