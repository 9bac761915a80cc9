"""Lifted functions give the numbers of the plain ones."""

import casadi as ca
import numpy as np
import pytest

from kemba.ocp import load_task
from kemba.ocp.functions.code import Code, parameterised
from kemba.ocp.reading import task_model
from kemba.ocp.task.resolve import resolve
from kemba.ocp.transcription.symmetry import whole
from kemba.ocp.transcription.transcribe import Transcription


def step(*options: str) -> Code:
    """One step of the jump as the program has it."""
    task, document = load_task("jump", ["nodes=24", *options])
    model = task_model(task)
    program = Transcription(model, task, resolve(task, model, document), whole(model.node), 24)
    return program.problem.blocks[0].code


def test_lifting_keeps_the_numbers() -> None:
    x = ca.SX.sym("x", 3)
    g = ca.vertcat(3.7 * ca.sin(x[0]) - x[1] ** 2, 3.7 / x[2], ca.fmax(x[0], 1.5) + 0.0 * x[1])
    (same,), constants, numbers = parameterised([x], [g])
    assert sorted(numbers) == [1.5, 3.7]
    at = np.array([0.3, -1.2, 0.7])
    plain, other = ca.Function("g", [x], [g]), ca.Function("g", [x, constants], [same])
    assert np.array(other(at, numbers)) == pytest.approx(np.array(plain(at)), rel=1e-15)


def test_tasks_that_differ_in_numbers_share_their_code() -> None:
    texts = []
    for supply, payload in (("0.65 MPa", "0.2 kg"), ("0.75 MPa", "0.7 kg")):
        block = step(f"supply={supply}", f"payload={payload}")
        f = ca.Function("f", [block.z, block.given], [block.f, block.g])
        texts.append(f.serialize())
    assert texts[0] == texts[1]
