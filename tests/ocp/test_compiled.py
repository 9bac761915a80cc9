"""Lifted and compiled functions give the numbers of the plain ones."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from kemba.ocp import load_task
from kemba.ocp.functions.code import Code
from kemba.ocp.functions.compiled import cache_folder, compiled, is_whole
from kemba.ocp.functions.constants import parameterised
from kemba.ocp.reading import task_model
from kemba.ocp.task.resolve import resolve
from kemba.ocp.transcription.symmetry import whole
from kemba.ocp.transcription.transcribe import Transcription

compiler = pytest.mark.skipif(
    not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="no compiler here"
)


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


@compiler
def test_compiled_is_the_same_to_the_last_bit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("KEMBA_CACHE", str(tmp_path))
    monkeypatch.delenv("KEMBA_COMPILE", raising=False)
    block = step()
    at = block.given
    plain = ca.Function("g", [block.z, at], [ca.densify(block.g)])
    (fast,) = compiled([plain], wait=True)
    assert sorted(path.suffix for path in tmp_path.iterdir()) == [".json", ".so"]
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
        if list(tmp_path.glob("*.json")):
            break
        time.sleep(0.1)
    assert compiled([plain])[0].class_name() != plain.class_name()


def sine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[ca.Function, Path]:
    """A function and its compiled library in a cache of its own."""
    monkeypatch.setenv("KEMBA_CACHE", str(tmp_path / "cache"))
    monkeypatch.delenv("KEMBA_COMPILE", raising=False)
    x = ca.SX.sym("x")
    plain = ca.Function("f", [x], [ca.sin(x)])
    assert is_compiled(compiled([plain], wait=True)[0])
    (library,) = (tmp_path / "cache").glob("*.so")
    return plain, library


def is_compiled(function: ca.Function) -> bool:
    return bool(function.class_name() != "SXFunction")


def replaced(library: Path, content: bytes) -> None:
    """Another file under the same name: this process has the old one in its memory."""
    library.unlink()
    library.write_bytes(content)
    library.chmod(0o700)


def cut(library: Path) -> None:
    replaced(library, library.read_bytes()[: library.stat().st_size // 2])


def zeroed(library: Path) -> None:
    replaced(library, bytes(library.stat().st_size))


def exchanged(library: Path) -> None:
    replaced(library, library.read_bytes() + b"x")


def without_manifest(library: Path) -> None:
    library.with_suffix(".json").unlink()


def odd_manifest(library: Path) -> None:
    library.with_suffix(".json").write_text("[1]")


def linked(library: Path) -> None:
    library.rename(library.with_suffix(".other"))
    library.symlink_to(library.with_suffix(".other"))


def open_to_all(library: Path) -> None:
    library.chmod(0o777)


@compiler
@pytest.mark.parametrize(
    "damage",
    [cut, zeroed, exchanged, without_manifest, odd_manifest, linked, open_to_all],
    ids=lambda damage: damage.__name__,
)
def test_a_damaged_library_is_made_anew(
    damage: Callable[[Path], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain, library = sine(tmp_path, monkeypatch)
    damage(library)
    assert not is_whole(library)
    again = compiled([plain], wait=True)[0]
    assert is_whole(library) and is_compiled(again)
    assert float(again(0.5)) == float(plain(0.5))


HALF = """#!/bin/sh
{compiler} "$@" || exit 1
for word; do [ "$before" = -o ] && made=$word; before=$word; done
head -c 6000 "$made" > "$made.half" && mv "$made.half" "$made"
"""


@compiler
def test_what_cannot_be_loaded_is_not_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A compiler that writes half a library: its hash would be right, and loading it would kill."""
    real = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))))
    half = tmp_path / "cc"
    half.write_text(HALF.format(compiler=real))
    half.chmod(0o700)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    monkeypatch.setenv("KEMBA_CACHE", str(tmp_path / "cache"))
    monkeypatch.delenv("KEMBA_COMPILE", raising=False)
    x = ca.SX.sym("x")
    plain = ca.Function("f", [x], [ca.sin(x)])
    assert compiled([plain], wait=True) == [plain]
    assert list((tmp_path / "cache").iterdir()) == []
    half.unlink()
    assert is_compiled(compiled([plain], wait=True)[0])


@compiler
@pytest.mark.parametrize("mode", [0o777, 0o770, 0o1777])
def test_a_folder_open_to_others_is_not_used(
    mode: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain, library = sine(tmp_path, monkeypatch)
    library.parent.chmod(mode)
    assert not is_compiled(compiled([plain], wait=True)[0])
    library.parent.chmod(0o700)
    assert is_compiled(compiled([plain], wait=True)[0])
    tmp_path.chmod(0o777)  # the folder could be exchanged as a whole
    assert not is_compiled(compiled([plain], wait=True)[0])


@compiler
@pytest.mark.skipif(os.name != "posix" or os.geteuid() != 0, reason="only root can give away")
def test_files_of_other_users_are_not_loaded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain, library = sine(tmp_path, monkeypatch)
    os.chown(library, 12345, 12345)
    assert not is_whole(library)
    os.chown(library.parent, 12345, 12345)
    assert not is_compiled(compiled([plain], wait=True)[0])


def test_a_user_without_a_home_does_without(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("KEMBA_CACHE", "XDG_CACHE_HOME", "KEMBA_COMPILE"):
        monkeypatch.delenv(name, raising=False)

    def nowhere() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", nowhere)
    x = ca.SX.sym("x")
    plain = [ca.Function("f", [x], [ca.sin(x)])]
    assert cache_folder() is None and compiled(plain) == plain


def test_without_a_compiler_functions_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KEMBA_COMPILE", "0")
    x = ca.SX.sym("x")
    plain = [ca.Function("f", [x], [ca.sin(x)])]
    assert compiled(plain) == plain
