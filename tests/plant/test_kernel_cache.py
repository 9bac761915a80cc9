"""The compiled kernel on disk: a missing or damaged cache only costs time."""

import os
import stat
from pathlib import Path

import numba
import pytest

from kemba.plant import simulate as loading
from kemba.plant.kernel import jit


def twice(x: float) -> float:
    return 2.0 * x


def test_what_was_compiled_is_loaded_again(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(jit, "FOLDER", str(tmp_path))
    first = jit.entry(twice)
    assert not jit.is_kept(first)
    assert first(2.0) == 4.0
    assert jit.is_kept(first) and jit.is_kept(jit.entry(twice))
    (kept,) = tmp_path.rglob("*.nbc")
    before = kept.stat().st_mtime_ns
    again = jit.entry(twice)
    assert again(2.0) == 4.0
    assert sum(again.__dict__["dispatcher"].stats.cache_hits.values()) == 1
    assert kept.stat().st_mtime_ns == before


def test_what_another_installation_left_is_not_what_this_one_has(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Numba compiles it anew, which takes half a minute of the kernel, and is said."""
    monkeypatch.setattr(jit, "FOLDER", str(tmp_path))
    jit.entry(twice)(2.0)
    (index,) = tmp_path.rglob("*.nbi")
    (other := tmp_path / "kernel_of_another").mkdir()
    index.rename(other / index.name)
    assert not jit.is_kept(jit.entry(twice))


@pytest.mark.parametrize("size", [0, 20])
def test_a_damaged_cache_is_not_used(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, size: int
) -> None:
    monkeypatch.setattr(jit, "FOLDER", str(tmp_path))
    jit.entry(twice)(2.0)
    for path in [*tmp_path.rglob("*.nbc"), *tmp_path.rglob("*.nbi")]:
        path.write_bytes(path.read_bytes()[:size])
    assert not jit.is_kept(jit.entry(twice))
    assert jit.entry(twice)(2.0) == 4.0


def test_without_a_folder_it_is_compiled_anew(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(jit, "FOLDER", None)
    assert jit.entry(twice)(2.0) == 4.0
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setattr(jit, "FOLDER", str(tmp_path / "file"))
    assert jit.entry(twice)(2.0) == 4.0


def test_only_a_folder_of_the_users_own_is_used(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("KEMBA_CACHE", str(tmp_path / "own"))
    found = jit.find_folder()
    assert found is not None and stat.S_IMODE(Path(found).stat().st_mode) == 0o700
    Path(found).chmod(0o777)
    assert jit.find_folder() is None


def test_numbas_own_settings_stay() -> None:
    before = numba.config.OPT, numba.config.CACHE_DIR, numba.config.LOOP_VECTORIZE
    jit.entry(twice)(3.0)
    assert before == (numba.config.OPT, numba.config.CACHE_DIR, numba.config.LOOP_VECTORIZE)


def test_a_user_without_a_home_has_no_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("KEMBA_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)

    def nowhere() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", nowhere)
    assert jit.find_folder() is None


@pytest.mark.skipif(os.name != "posix" or os.geteuid() != 0, reason="only root can give away")
def test_a_folder_of_another_user_is_not_used(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("KEMBA_CACHE", str(tmp_path))
    assert jit.find_folder() is not None
    os.chown(tmp_path, 12345, 12345)
    assert jit.find_folder() is None


def test_the_first_time_a_second_process_compiles(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    started: list[None] = []
    monkeypatch.setattr(loading, "_compiler", lambda: started.append(None))
    monkeypatch.setattr(jit, "FOLDER", str(tmp_path))
    monkeypatch.setattr(jit, "is_kept", lambda entry: False)
    loading._load()
    assert len(started) == 1
    monkeypatch.setattr(jit, "is_kept", lambda entry: True)
    loading._load()
    monkeypatch.setattr(jit, "is_kept", lambda entry: False)
    monkeypatch.setattr(jit, "FOLDER", None)
    loading._load()
    assert len(started) == 1


@pytest.mark.parametrize("kept", [True, False])
def test_who_waits_for_the_compiler_is_told(monkeypatch: pytest.MonkeyPatch, kept: bool) -> None:
    done: list[str] = []
    monkeypatch.setattr(jit, "is_kept", lambda name: kept)
    monkeypatch.setattr(loading, "compile_kernel", lambda: done.append("compiled"))
    loading.wait_for_compiler(done.append)
    assert done == ([] if kept else ["compiling the simulator, once on this machine", "compiled"])
