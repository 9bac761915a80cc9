"""The simulator's compiler, loaded by a second thread while a plan is sought."""

from __future__ import annotations

import os
import sys
from threading import Thread


def load_meanwhile() -> None:
    """Begin to import the simulator in a second thread, where there is a core for it.

    CasADi's solvers leave Python to other threads while they work; this one does not touch CasADi.
    """
    if (os.cpu_count() or 1) > 1 and "numba" not in sys.modules:
        Thread(target=_load, name="loading").start()


def _load() -> None:
    import kemba.plant.simulation.player  # noqa: F401
    from kemba.plant.kernel.jit import load

    load()
