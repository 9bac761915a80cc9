"""Ctrl-C as a request to stop: the first ends the work and keeps its result, the second quits."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable
from types import FrameType
from typing import Any

SHOW_CURSOR = "\x1b[?25h"


class Interrupt:
    """A context in which SIGINT only sets a flag, which solvers read after every iteration.

    Calling it tells whether to stop. `tell` gets a message at the first Ctrl-C. The second one
    ends the process by the default handler: an exception would be lost in a solver's callback.
    Outside the main thread the context changes nothing.
    """

    def __init__(self, tell: Callable[[str], None] = lambda text: None) -> None:
        self.asked = False
        self.tell = tell
        self._before: Any = None

    def __call__(self) -> bool:
        return self.asked

    def __enter__(self) -> Interrupt:
        if threading.current_thread() is threading.main_thread():
            self._before = signal.signal(signal.SIGINT, self._on_signal)
        return self

    def __exit__(self, *error: object) -> None:
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self.asked:
            if sys.stderr.isatty():
                sys.stderr.write(SHOW_CURSOR)  # a progress bar may have hidden it
                sys.stderr.flush()
            signal.signal(signal.SIGINT, signal.SIG_DFL)
            signal.raise_signal(signal.SIGINT)
        self.asked = True
        self.tell("interrupted: writing the best iterate; press Ctrl-C again to quit at once")
