"""The simulator's compiler, loaded or put to work while a plan is sought."""

from __future__ import annotations

import os
import subprocess
import sys
from threading import Thread

_STARTED: list[subprocess.Popen[bytes]] = []  # nobody waits for it: the kernel's lock does


def load_meanwhile() -> None:
    """Begin to import the simulator in a second thread, where there is a core for it; the first
    time on a machine, also to compile it in a second process.

    CasADi's solvers leave Python to other threads while they work; this one does not touch CasADi.
    """
    if (os.cpu_count() or 1) > 1 and "numba" not in sys.modules:
        Thread(target=_load, name="loading").start()


def _load() -> None:
    import kemba.plant.simulation.player  # noqa: F401
    from kemba.plant.kernel.jit import FOLDER, is_kept, load

    if FOLDER is not None and not is_kept("play"):
        _STARTED.append(_compiler())
    load()


def _compiler() -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-c", f"from {__name__} import compile_kernel; compile_kernel()"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def compile_kernel() -> None:
    """Have the kernel compiled and kept, by a simulation that is as short as any."""
    from kemba.model import load_model
    from kemba.plant.simulation.simulate import run

    run(load_model("plant"), duration=2e-3)
