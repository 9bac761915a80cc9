"""Factorising a Newton step: MUMPS, LAPACK's band solver, and block by block along the nodes.

    python benchmarks/kkt.py [--task jump_forward] [--nodes 50]

The matrix is IPOPT's for the whole robot's program at the start guess: Hessian and barrier terms,
slacks of inequalities, rows. Ordered node after node it is banded, and block tridiagonal.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from itertools import pairwise

import casadi as ca
import numpy as np
from scipy.linalg.lapack import dgbtrf
from scipy.sparse import block_array, block_diag, csc_array, eye_array

from kemba.model import load_model
from kemba.ocp import load_task
from kemba.ocp.ipopt import Parameters
from kemba.ocp.mirror import whole
from kemba.ocp.planner import Planner
from kemba.ocp.transcribe import Transcription
from kemba.ocp.wishes import resolve
from kemba.sweep import machine

REPEATS = 20


def program(name: str, nodes: int) -> tuple[Transcription, np.ndarray]:
    """The whole robot's program of a task, and its start guess."""
    task, document = load_task(name)
    model = load_model(task.model)
    planner = Planner(task, model, resolve(task, model, document))
    transcription = planner.search(nodes, whole(model.node)).transcription
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
    K, node = newton(*program(asked.task, asked.nodes))
    order = np.argsort(node, kind="stable")
    K, node = csc_array(K[np.ix_(order, order)]), node[order]
    print(f"{K.shape[0]} columns, {K.nnz} entries, {asked.nodes} nodes, {machine()}\n")
    ways = {"MUMPS": mumps(K), "band": banded(K), "blocks": by_blocks(K, node)}
    for name, work in ways.items():
        print(f"{name}: {milliseconds(work):.1f} ms")


if __name__ == "__main__":
    main()
