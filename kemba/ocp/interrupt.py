"""Ctrl-C as a wish to stop: the first ends the work in order, the second at once."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from types import FrameType, TracebackType
from typing import Any


class Interrupt:
    """While it stands, SIGINT only sets a flag that solvers look at between iterations.

    Call it to ask whether to stop. `tell` hears of the first Ctrl-C; the second raises
    KeyboardInterrupt. Outside the main thread it changes nothing.
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

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True
        self.tell("interrupted: writing the best iterate; press Ctrl-C again to quit at once")
