"""Factorising a Newton step: MUMPS, LAPACK's band solver, block by block along the nodes, and MUMPS
with states eliminated by hand.

    python benchmarks/kkt.py [--task jump_forward] [--nodes 50]

The matrix is IPOPT's for the whole robot's program at the start guess: Hessian and barrier terms,
slacks of inequalities, rows. Ordered node after node it is banded, and block tridiagonal.
"""

import argparse
import time
from collections.abc import Callable
from itertools import pairwise

import casadi as ca
import numpy as np
from scipy.linalg.lapack import dgbtrf
from scipy.sparse import block_array, block_diag, csc_array, eye_array
from scipy.sparse.linalg import splu

from kemba.model import load_model
from kemba.ocp import load_task
from kemba.ocp.planner import Planner
from kemba.ocp.task.resolve import resolve
from kemba.ocp.transcription.symmetry import whole
from kemba.ocp.transcription.transcribe import Parameters, Transcription
from kemba.sweep import machine

REPEATS = 20


def program(name: str, nodes: int) -> tuple[Transcription, np.ndarray]:
    """The whole robot's program of a task, and its start guess."""
    task, document = load_task(name)
    model = load_model(task.model)
    planner = Planner(task, model, resolve(task, model, document))
    transcription = planner.schedule(nodes, whole(model.node)).transcription
    return transcription, planner.guess(transcription).Y


def newton(t: Transcription, Y: np.ndarray) -> tuple[csc_array, np.ndarray]:
    """IPOPT's matrix, and the node that each of its columns belongs to."""
    free = np.flatnonzero((t.lower < t.upper).ravel())
    p = Parameters(1e-3).vector(t.nodes)
    multipliers = np.ones(t.problem.rows)
    upper = t.problem.hess_lag(Y.ravel(), p, 1.0, multipliers)
    H = ca.triu2symm(upper).sparse()[np.ix_(free, free)]
    J = csc_array(t.problem.jac_g(Y.ravel(), p)[1].sparse())[:, free]
    unequal = np.flatnonzero(t.g_lower < t.g_upper)
    slacks = csc_array(-eye_array(t.problem.rows).tocsc()[:, unequal])
    W = block_diag([H + eye_array(len(free)), eye_array(len(unequal))])
    A = block_array([[J, slacks]])
    K = csc_array(block_array([[W, A.T], [A, -1e-8 * eye_array(t.problem.rows)]]))
    of_variable = free // t.shape[1]
    of_row = np.array([of_variable[row.indices].max(initial=0) for row in J.tocsr()])
    return K, np.concatenate([of_variable, of_row[unequal], of_row])


def mumps(K: csc_array) -> Callable[[], object]:
    """CasADi's interface to the MUMPS that IPOPT uses; its analysis is done once."""
    K.sort_indices()
    matrix = ca.DM(K)
    solver = ca.Linsol("solver", "mumps", matrix.sparsity(), {"symmetric": True})
    solver.sfact(matrix)
    return lambda: solver.nfact(matrix)


def banded(K: csc_array) -> Callable[[], object]:
    """LAPACK's LU of a band matrix."""
    entries = K.tocoo()
    width = int(np.abs(entries.row - entries.col).max())
    band = np.zeros((3 * width + 1, K.shape[0]))
    band[2 * width + entries.row - entries.col, entries.col] = entries.data
    return lambda: dgbtrf(band, width, width)


def by_blocks(K: csc_array, node: np.ndarray) -> Callable[[], object]:
    """Dense blocks of the nodes, eliminated one after the other; of a block's inverse only what
    its neighbour touches is made."""
    places = [np.flatnonzero(node == k) for k in range(node.max() + 1)]
    own = [K[np.ix_(at, at)].toarray() for at in places]
    couplings = []
    for before, at in pairwise(places):
        block = K[np.ix_(at, before)].toarray()
        touched = np.flatnonzero(block.any(axis=0))
        couplings.append((block[:, touched], np.eye(len(before))[:, touched], touched))

    def eliminate() -> None:
        block = own[0]
        for (coupling, unit, touched), following in zip(couplings, own[1:], strict=True):
            inverse = np.linalg.solve(block, unit)[touched]
            block = following - coupling @ inverse @ coupling.T

    return eliminate


def without(K: csc_array, t: Transcription, group: str, rows: str) -> csc_array:
    """The matrix without a group of states and the rows that give them, by a Schur complement."""
    variables = np.flatnonzero((t.lower < t.upper).ravel())
    part, first_row = t.layout.slices[group], K.shape[0] - t.problem.rows
    column = variables % t.shape[1]
    states = (part.start <= column) & (column < part.stop) & (variables >= t.shape[1])
    given = [i for i, m in enumerate(t.meanings) if m.label.startswith(rows) and m.node > 0]
    gone = np.concatenate([np.flatnonzero(states), first_row + np.array(given)])
    left = np.setdiff1d(np.arange(K.shape[0]), gone)
    through = splu(K[np.ix_(gone, gone)].tocsc()).solve(K[np.ix_(gone, left)].toarray())
    dense = K[np.ix_(left, left)].toarray() - K[np.ix_(left, gone)] @ through
    return csc_array(np.where(np.abs(dense + dense.T) > 1e-13, (dense + dense.T) / 2, 0.0))


def milliseconds(work: Callable[[], object]) -> float:
    """The quickest of some repetitions."""
    taken = []
    for _ in range(REPEATS):
        start = time.process_time()
        work()
        taken.append(time.process_time() - start)
    return 1e3 * min(taken)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--task", default="jump_forward")
    parser.add_argument("--nodes", type=int, default=50)
    asked = parser.parse_args()
    t, Y = program(asked.task, asked.nodes)
    K, node = newton(t, Y)
    print(f"{K.shape[0]} columns, {K.nnz} entries, {asked.nodes} nodes, {machine()}\n")
    for group, rows in (("v", "kinematics:"), ("s", "rate:")):
        less = without(K, t, group, rows)
        taken = milliseconds(mumps(less))
        print(f"MUMPS without {group}: {taken:.1f} ms, {less.shape[0]} columns, {less.nnz} entries")
    order = np.argsort(node, kind="stable")
    K, node = csc_array(K[np.ix_(order, order)]), node[order]
    ways = {"MUMPS": mumps(K), "band": banded(K), "blocks": by_blocks(K, node)}
    for name, work in ways.items():
        print(f"{name}: {milliseconds(work):.1f} ms")


if __name__ == "__main__":
    main()
