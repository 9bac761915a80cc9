"""Too little memory is told in words, within seconds."""

import errno
import subprocess
import sys

import pytest

from kemba_cli.failures import NEEDED, shortage, used_up

resource = pytest.importorskip("resource")
COMMAND = [sys.executable, "-c", "from kemba_cli.main import main; main()"]


@pytest.mark.parametrize("verb", [["check", "jump.yaml"], ["solve", "jump.yaml"]])
def test_a_memory_limit_is_told_before_the_work(verb: list[str]) -> None:
    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (300_000_000, 300_000_000))

    done = subprocess.run(
        [*COMMAND, *verb], capture_output=True, text=True, preexec_fn=limit, timeout=120
    )
    assert done.returncode == 1
    assert "the memory limit of this shell is 300 MB (`ulimit -v`); about" in done.stderr


def test_enough_memory_is_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "1")
    for limit in (resource.RLIM_INFINITY, NEEDED):
        monkeypatch.setattr(resource, "getrlimit", lambda _, limit=limit: (limit, limit))
        assert shortage() == ""
    monkeypatch.setattr(resource, "getrlimit", lambda _: (NEEDED - 1, NEEDED))
    assert "1000 MB were expected" in shortage()


def test_memory_that_runs_out_is_no_fault_of_kemba() -> None:
    for error in (
        MemoryError(),
        OSError(errno.ENOMEM, "Cannot allocate memory"),
        ImportError("libx.so: failed to map segment from shared object"),
        RuntimeError("std::bad_alloc"),
    ):
        assert used_up(error).startswith("there is not enough memory (")
    assert used_up(RuntimeError("row")) == used_up(OSError(errno.ENOENT, "x")) == ""
