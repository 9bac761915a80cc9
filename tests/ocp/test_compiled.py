"""Lifted and compiled functions give the numbers of the plain ones."""

from __future__ import annotations

import shutil
import time
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from kemba.ocp import load_task
from kemba.ocp.nlp.blocks import Block
from kemba.ocp.nlp.compiled import compiled
from kemba.ocp.nlp.constants import parameterised
from kemba.ocp.planning import task_model
from kemba.ocp.task.requirement import resolve
from kemba.ocp.transcription.symmetry import whole
from kemba.ocp.transcription.transcribe import Transcription

compiler = pytest.mark.skipif(
    not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="no compiler here"
)


def step(*options: str) -> tuple[Block, ca.SX]:
    """One step of the jump as the program has it, and its parameters."""
    task, document = load_task("jump", ["nodes=24", *options])
    model = task_model(task)
    program = Transcription(model, task, resolve(task, model, document), whole(model.node), 24)
    return program.problem.blocks[0], program.problem.p


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
        block, p = step(f"supply={supply}", f"payload={payload}")
        f = ca.Function("f", [block.z, ca.vertcat(p, block.constants)], [block.f, block.g])
        texts.append(f.serialize())
    assert texts[0] == texts[1]


@compiler
def test_compiled_is_the_same_to_the_last_bit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("KEMBA_CACHE", str(tmp_path))
    monkeypatch.delenv("KEMBA_COMPILE", raising=False)
    block, p = step()
    at = ca.vertcat(p, block.constants)
    plain = ca.Function("g", [block.z, at], [ca.densify(block.g)])
    (fast,) = compiled([plain], wait=True)
    assert [path.suffix for path in tmp_path.iterdir()] == [".so"]
    assert fast.class_name() != plain.class_name()
    z = np.random.default_rng(0).normal(0.5, 0.1, block.z.numel())
    values = np.concatenate([[1e-3, 0.1, 0.1, 0.1, 1e-5], block.numbers])
    assert np.array_equal(np.array(fast(z, values)), np.array(plain(z, values)))


@compiler
def test_the_first_solve_does_not_wait(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KEMBA_CACHE", str(tmp_path))
    monkeypatch.delenv("KEMBA_COMPILE", raising=False)
    x = ca.SX.sym("x")
    plain = ca.Function("f", [x], [ca.sin(x)])
    (first,) = compiled([plain])
    assert first.class_name() == plain.class_name()
    for _ in range(300):
        if list(tmp_path.glob("*.so")):
            break
        time.sleep(0.1)
    assert compiled([plain])[0].class_name() != plain.class_name()


def test_without_a_compiler_functions_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KEMBA_COMPILE", "0")
    x = ca.SX.sym("x")
    plain = [ca.Function("f", [x], [ca.sin(x)])]
    assert compiled(plain) == plain
