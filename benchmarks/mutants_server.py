"""Runs tests on request, each in a fork of this process, which has the libraries loaded already.

`benchmarks/mutants.py` starts it in a copy of the tree. A request is a line of JSON on the standard
input: a list of tests. The answer is a line of JSON: the exit code of pytest, and the first test
that failed. Nothing of the project itself is loaded before the fork, so that each run sees the
files as they are then. A new process for every run would spend most of its time on imports.
"""

import contextlib
import importlib
import json
import os
import signal
import sys
import time
from typing import Any

import pytest

LIBRARIES = (
    "casadi", "numpy", "scipy.linalg", "scipy.optimize", "scipy.signal", "scipy.ndimage",
    "scipy.stats", "pydantic", "typer.testing", "yaml", "rich.console", "rich.table", "filelock",
    "numba",
)  # fmt: skip
# plugins that are loaded before pytest begins are not to be told of
LOADED = "ignore::pytest.PytestAssertRewriteWarning"
OPTIONS = ["-x", "-q", "-p", "no:cacheprovider", "-W", LOADED]
HANGS = -1  # exit code of a run that was ended


class First:
    """Keeps the first test that failed, or the file that could not be loaded."""

    failed = ""

    def pytest_runtest_logreport(self, report: Any) -> None:
        self._keep(report)

    def pytest_collectreport(self, report: Any) -> None:
        self._keep(report)

    def _keep(self, report: Any) -> None:
        if report.failed and not self.failed:
            self.failed = report.nodeid


def run(tests: list[str], longest: float) -> tuple[int, str]:
    """Exit code of pytest on `tests`, at most `longest` [s], and the first that failed."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.setsid()
        os.close(reader)
        silent = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(silent, stream)
        first = First()
        try:
            code = int(pytest.main([*OPTIONS, *tests], plugins=[first]))
            os.write(writer, json.dumps([code, first.failed]).encode())
        finally:
            os._exit(0)
    os.close(writer)
    end = time.monotonic() + longest
    while os.waitpid(child, os.WNOHANG) == (0, 0):
        if time.monotonic() > end:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(child, signal.SIGKILL)
            os.waitpid(child, 0)
            break
        time.sleep(0.02)
    with os.fdopen(reader, "rb") as answer:
        said = answer.read()
    return tuple(json.loads(said)) if said else (HANGS, "")


def main() -> None:
    for library in LIBRARIES:
        with contextlib.suppress(ImportError):
            importlib.import_module(library)
    for line in sys.stdin:
        request = json.loads(line)
        print(json.dumps(run(request["tests"], request["longest"])), flush=True)


if __name__ == "__main__":
    main()
