"""Loaded by our own workers: Ctrl-C reaches the whole terminal, but only the client answers it."""

import signal
from typing import Any


def dask_setup(_: Any) -> None:
    """Called by dask when a worker starts."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
